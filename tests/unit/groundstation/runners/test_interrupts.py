"""Ctrl-C ends a run between two steps: whatever it interrupts, the run can be closed in good order."""

import signal
import threading
from pathlib import Path

import pytest

from groundstation.rig.read import parse_rig
from groundstation.runners.interrupts import InterruptBetweenSteps
from groundstation.runners.make_runner import make_runner

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "two_mock_ups_drawn.toml"


class Struck:
    """Ctrl-C after so many calls of what it stands before."""

    def __init__(self, before, calls):
        self.before, self.calls = before, calls

    def __call__(self, *arguments):
        self.calls -= 1
        if self.calls == 0:
            signal.raise_signal(signal.SIGINT)
        return self.before(*arguments)


def last_stamps():
    stamps = []
    return stamps, lambda delivered, now_ns: stamps.append(now_ns)


@pytest.mark.parametrize("calls", [1, 2, 3, 5, 40, 41, 300])
@pytest.mark.parametrize("where", ["laboratory", "observer"])
def test_a_run_that_is_interrupted_anywhere_closes_in_good_order(where, calls):
    stamps, observe = last_stamps()
    observer = Struck(observe, calls) if where == "observer" else observe
    runner = make_runner(parse_rig(RIG.read_text(), RIG), 1, [observer])
    laboratory = runner._laboratory
    if where == "laboratory":
        laboratory.advance = Struck(laboratory.advance, calls)
    with pytest.raises(KeyboardInterrupt):
        runner.run(5_000_000_000)
    before = len(stamps)
    runner.close()
    assert len(stamps) > before  # last messages of nodes came out
    assert stamps == sorted(stamps)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def struck(times, error=None):
    """A step in which Ctrl-C comes so many times."""
    with InterruptBetweenSteps() as interrupt:
        for _ in range(times):
            signal.raise_signal(signal.SIGINT)
        assert interrupt.is_due
        assert times == 1, "the second one did not come at once"
        if error is not None:
            raise error


def test_a_second_one_comes_at_once():
    with pytest.raises(KeyboardInterrupt):
        struck(2)


def test_one_that_came_in_the_last_step_is_not_lost():
    with pytest.raises(KeyboardInterrupt):
        struck(1)


def test_an_error_of_the_run_goes_before_it():
    with pytest.raises(ValueError, match="the laboratory"):
        struck(1, ValueError("the laboratory"))


def test_a_handler_of_somebody_else_stays_in_force():
    came = []
    before = signal.signal(signal.SIGINT, lambda number, frame: came.append(number))
    try:
        with InterruptBetweenSteps() as interrupt:
            signal.raise_signal(signal.SIGINT)
            assert not interrupt.is_due
    finally:
        signal.signal(signal.SIGINT, before)
    assert came == [signal.SIGINT]


def test_other_threads_hold_nothing_back():
    held = []

    def hold():
        with InterruptBetweenSteps() as interrupt:
            held.append((signal.getsignal(signal.SIGINT) is signal.default_int_handler, interrupt.is_due))

    thread = threading.Thread(target=hold)
    thread.start()
    thread.join()
    assert held == [(True, False)]
