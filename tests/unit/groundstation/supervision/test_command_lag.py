"""Commands that are on their way for longer than usual, whatever is usual on a line."""

import pytest

from groundstation.supervision.command_lag import COUNTER_MODULUS, RECENT, CommandLag

MS = 1_000_000
PERIOD_MS = 20


def told(lag_ms, lates=()):
    """Counters go out each 20 ms and reach the node later; which of its statuses, each 20 ms, are late."""
    lag, found = CommandLag(), []
    arrivals = {}
    for number in range(3 * RECENT):
        sent_ms = number * PERIOD_MS
        arrivals[number] = sent_ms + lag_ms + dict(lates).get(number, 0.0)
        lag.command(sent_ms * MS, number % COUNTER_MODULUS)
        status_ms = sent_ms + 15.0
        received = max((each for each, at_ms in arrivals.items() if at_ms <= status_ms), default=0)
        if lag.is_late(round(status_ms * MS), received % COUNTER_MODULUS):
            found.append(number)
    return found


@pytest.mark.parametrize("lag_ms", [1.0, 14.0, 18.0, 33.0])
def test_what_is_usual_on_a_line_is_not_late(lag_ms):
    assert told(lag_ms) == []


@pytest.mark.parametrize("lag_ms", [1.0, 18.0])
def test_a_command_that_is_late_is_seen_and_no_other(lag_ms):
    first = 2 * RECENT + 7
    found = told(lag_ms, [(first, 50.0)])
    assert first <= found[0] <= first + 2
    assert found[-1] <= first + 4


def test_no_command_is_behind_when_the_newest_was_received():
    lag = CommandLag()
    lag.command(0, 15)
    lag.command(20 * MS, 0)
    assert (lag.behind(0), lag.behind(15), lag.behind(14)) == (0, 1, 2)
    assert not lag.is_late(900 * MS, 0)
