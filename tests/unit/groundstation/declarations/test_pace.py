from hypothesis import given
from hypothesis import strategies as st

from groundstation.declarations.topic import Pace

MS = 1_000_000
stamps = st.lists(st.integers(0, 3 * 10**9), min_size=1).map(sorted)


@given(stamps)
def test_one_message_passes_in_each_period_that_has_any_and_it_is_the_first(stamps_ns):
    pace = Pace(20 * MS)
    passed = [stamp for stamp in stamps_ns if pace.passes(stamp)]
    assert [stamp // (20 * MS) for stamp in passed] == sorted({stamp // (20 * MS) for stamp in stamps_ns})
    assert all(stamp == min(s for s in stamps_ns if s // (20 * MS) == stamp // (20 * MS)) for stamp in passed)


@given(stamps)
def test_a_second_pace_passes_what_the_first_one_passed(stamps_ns):
    """Publisher and receiver both apply it."""
    first, second = Pace(20 * MS), Pace(20 * MS)
    passed = [stamp for stamp in stamps_ns if first.passes(stamp)]
    assert [stamp for stamp in passed if second.passes(stamp)] == passed
