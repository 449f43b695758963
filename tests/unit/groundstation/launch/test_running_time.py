"""The launcher's running time."""

import pytest

from groundstation.launch.running_time import RunningTime


def test_it_runs_with_the_clock_while_the_loop_comes_by():
    time = RunningTime()
    for step in range(101):
        time.step(1000.0 + 0.05 * step)
    assert time.now_s == pytest.approx(5.0)


def test_a_pause_of_the_loop_does_not_count():
    time = RunningTime()
    time.step(1000.0)
    time.step(1000.1)
    assert time.step(1060.0) == pytest.approx(0.6)
    assert time.step(1060.1) == pytest.approx(0.7)


def test_a_clock_that_goes_back_does_not_turn_it_back():
    time = RunningTime()
    time.step(1000.0)
    assert time.step(999.0) == 0.0
    assert time.step(999.2) == pytest.approx(0.2)
