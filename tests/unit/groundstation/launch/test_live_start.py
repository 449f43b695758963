"""A live run that does not become ready ends with a sentence where nobody watches it."""

from pathlib import Path

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

        def monotonic(self):
            return self.now_s

    clock = Clock()
    monkeypatch.setattr(live_run, "time", clock)
    return clock


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
