"""Refused pictures are chosen by their stamps: the first at once, the same again ever later."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from groundstation.parts.stars.picture_choice import LONGEST_NS, SOONEST_NS, PictureChoice

S = 1_000_000_000
PERIOD_NS = S // 15


def chosen(choice, kinds, start_ns=0):
    stamps = [start_ns + i * PERIOD_NS for i in range(len(kinds))]
    return [stamp for stamp, kind in zip(stamps, kinds, strict=True) if choice.wants(stamp, kind)]


def test_the_same_refusal_is_shown_at_once_and_then_after_doubling_gaps():
    found = chosen(PictureChoice(), ["no light spots"] * 15 * 100)
    assert found[0] == 0
    gaps = [after - before for before, after in itertools.pairwise(found)]
    assert [round(gap / S) for gap in gaps] == [1, 2, 4, 8, 16, 32, 32]


def test_another_refusal_is_shown_after_a_second():
    choice = PictureChoice()
    chosen(choice, ["no light spots"] * 15 * 60)
    start_ns = 60 * S
    assert chosen(choice, ["too few stars"] * 15, start_ns)[0] == start_ns


def test_a_fix_is_shown_only_on_request_and_once():
    choice = PictureChoice()
    assert chosen(choice, [""] * 30) == []
    choice.ask()
    assert chosen(choice, [""] * 30, 3 * S) == [3 * S]


@given(st.lists(st.sampled_from(["", "no light spots", "too few stars", "no consensus"]), max_size=400))
def test_without_requests_pictures_of_refusals_come_a_second_apart(kinds):
    found = chosen(PictureChoice(), kinds)
    assert all(after - before >= SOONEST_NS for before, after in itertools.pairwise(found))
    refused = [i for i, kind in enumerate(kinds) if kind]
    assert bool(found) == bool(refused)
    assert LONGEST_NS >= SOONEST_NS
