"""A live run that does not become ready ends with a sentence where nobody watches it."""

from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import pytest

from groundstation.declarations.errors import GroundStationError
from groundstation.launch import live_run
from groundstation.launch.live_run import READY_S, LiveRun
from groundstation.rig.read import load_rig

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"


@pytest.fixture
def live(tmp_path):
    return LiveRun(load_rig(RIG), RIG.read_text(), RIG, tmp_path / "run.mcap")


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now_s = 100.0
        sleeps = 0
        pauses_s: ClassVar = {}

        def monotonic(self):
            return self.now_s

        def monotonic_ns(self):
            return round(self.now_s * 1e9)

        def sleep(self, for_s):
            self.sleeps += 1
            self.now_s += for_s + self.pauses_s.get(self.sleeps, 0.0)

    clock = Clock()
    monkeypatch.setattr(live_run, "time", clock)
    return clock


@pytest.fixture
def alone(live):
    """A run whose launcher has nothing to look after."""
    live.launcher = SimpleNamespace(supervise=lambda: None, bus=None, recorder=live.launcher.recorder)
    return live


def wait(live, clock, for_s):
    for _ in range(round(for_s / 0.25)):
        clock.now_s += 0.25
        live.check_start()


def test_it_waits_as_long_as_the_laboratory_and_the_processes_may_take_and_names_who_is_missing(live, clock):
    wait(live, clock, READY_S)
    with pytest.raises(GroundStationError, match=r"not ready after 60 s: .*laboratory, recorder, commands"):
        wait(live, clock, 1.0)


def test_time_in_which_it_was_paused_does_not_count(live, clock):
    wait(live, clock, READY_S - 1.0)
    clock.now_s += 600.0
    live.check_start()


def test_a_run_that_is_ready_waits_for_nothing(live, clock):
    for child in live.launcher.children:
        child.is_ready = True
    wait(live, clock, 2 * READY_S)


STOOD = "the run stood still for 60."


@pytest.mark.parametrize("sleep", [1, 3, 5])
def test_a_pause_is_noted_and_told_wherever_in_a_step_it_comes(alone, clock, sleep):
    clock.pauses_s = {sleep: 60.0}
    assert alone.step(0.25) == pytest.approx(60.0, abs=0.1)
    assert [line for line in alone.monitor.lines if STOOD in line]
    assert alone.step(0.25) == 0.0
    assert len([line for line in alone.monitor.lines if STOOD in line]) == 1


def test_a_pause_between_two_steps_is_noted_too(alone, clock):
    assert alone.step(0.25) == 0.0
    clock.now_s += 60.0
    assert alone.step(0.25) == pytest.approx(60.0, abs=0.1)


def test_what_came_before_the_first_look_and_a_busy_machine_are_no_pause(alone, clock):
    clock.now_s += 60.0
    clock.pauses_s = {2: 1.0, 6: 1.9}
    assert alone.step(0.25) == alone.step(0.25) == alone.step(0.25) == 0.0
    assert not [line for line in alone.monitor.lines if "stood still" in line]
