"""A sighting that another mock-up explains: by places that are known, and by places that are not."""

import math

import numpy as np
import pytest

from groundstation.relative_navigation.rivals import OLDEST_NS, KnownPlace, PlaceMemory, rivals_of, taken_for
from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.sighting import seen_at

SIGMA = (1e-3, 1e-3, 1e-3)
PLAIN = SideBody("alpha", 0.15, 0.06, 0.34)
MARKED = SideBody("gamma", 0.15, 0.06, 0.34, (0.0, 1.0, 2.5), (0.1, 0.2, 0.3), 0.01)


def at(x_m, y_m, heading_rad=0.0):
    return KnownPlace(0, (x_m, y_m), heading_rad, (0.0, 0.0), 0.0, SIGMA)


def sighting(x_m, y_m):
    return seen_at(np.array((x_m, y_m)), math.nan, np.diag((1e-6, 1e-6, math.inf)), 50, 1.0)


def said(leader, gamma, own=True, rivals=True):
    """The own mock-up at (1, 0) looks back: what it sees 1.5 m ahead is at (-0.5, 0)."""
    known = {"gamma": (0.3, gamma)} if rivals else {}
    return taken_for(
        sighting(1.5, 0.0), at(1.0, 0.0, math.pi) if own else None, ("alpha", 0.15, leader), known
    )


@pytest.mark.parametrize(
    ("leader", "gamma", "reason"),
    [
        (at(-0.5, 0.0), at(0.5, 1.0), ""),
        (at(-0.53, 0.02), at(0.5, 1.0), ""),  # its own fixes are 36 mm off: that moves no sighting
        (at(-1.5, 0.9), at(-0.5, 0.01), "is where gamma is"),
        (at(-1.5, 0.9), at(-0.5, 0.4), "is where gamma is"),  # far from both, nearer to gamma
        (None, at(-0.5, 0.01), "is where gamma is"),
        (None, at(0.5, 1.0), ""),
        (at(-0.5, 0.0), None, ""),
        (at(-0.9, 0.0), None, "it may be gamma, whose own place is not known"),
        (None, None, "it may be gamma, whose own place is not known"),
    ],
)
def test_the_nearer_one_explains_a_sighting(leader, gamma, reason):
    found = said(leader, gamma)
    assert reason in found
    assert bool(found) == bool(reason)


def test_without_the_own_place_nothing_tells_them_apart():
    assert "the own place is not known" in said(at(-0.5, 0.0), at(0.5, 1.0), own=False)
    assert said(None, None, own=False, rivals=False) == ""


def test_by_markers_only_who_wears_some_is_taken_for_the_leader():
    others = {"beta": PLAIN, "gamma": MARKED, "delta": None}
    assert set(rivals_of(MARKED, others, "markers")) == {"gamma", "delta"}
    assert set(rivals_of(PLAIN, others, "lit_part")) == {"beta", "gamma", "delta"}


def test_a_place_is_carried_to_the_exposure_and_not_for_long():
    memory = PlaceMemory()
    memory.remember(KnownPlace(1_000_000_000, (0.0, 0.0), 0.0, (0.1, 0.0), 0.5, SIGMA))
    found = memory.at(1_100_000_000)
    assert found.position_table_m == pytest.approx((0.01, 0.0))
    assert found.heading_rad == pytest.approx(0.05)
    assert memory.at(1_000_000_000 + OLDEST_NS + 1) is None
    memory.forget()
    assert memory.at(1_000_000_000) is None
