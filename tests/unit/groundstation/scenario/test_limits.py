"""A limit holds for every vehicle that it names, or for every pair."""

import pytest

from groundstation.scenario.limits import expanded
from groundstation.scenario.scenario_file import Limit

GROUPS = {
    "alpha": ("alpha",), "beta": ("beta",), "gamma": ("gamma",), "all": ("alpha", "beta", "gamma"),
    "followers": ("beta", "gamma"),
}  # fmt: skip
PAIRS = [("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma")]


@pytest.mark.parametrize(
    ("what", "keys", "expected"),
    [
        ("settling_s", {"vehicles": ["alpha", "beta"]}, [("alpha",), ("beta",)]),
        ("settling_s", {"vehicles": ["gamma", "all"]}, [("gamma",), ("alpha",), ("beta",)]),
        ("settling_s", {"vehicle": "followers"}, [("beta",), ("gamma",)]),
        ("least_distance_mm", {"vehicle": "all"}, PAIRS),
        ("least_distance_mm", {"vehicles": ["all"]}, PAIRS),
        ("least_distance_mm", {"vehicle": "followers"}, [("beta", "gamma")]),
        ("least_distance_mm", {"vehicles": ["beta", "alpha"]}, [("beta", "alpha")]),
    ],
)
def test_a_limit_holds_for_each_or_for_each_pair(what, keys, expected):
    limit = Limit.model_validate({"what": what, "below": 50.0, **keys})
    assert expanded(limit, 0, GROUPS) == expected
