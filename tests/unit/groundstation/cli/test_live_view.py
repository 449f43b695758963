"""When a live run ends by itself: after its duration, in which a pause does not count."""

from types import SimpleNamespace

import pytest

from groundstation.cli import live_view
from groundstation.cli.live_view import REFRESH_S, WAKING_S, run_live
from groundstation.parts.table import own_tables
from groundstation.watch.monitor import Monitor

START_S = 100.0


class FakeLive:
    """Is ready at once; each step takes its time, and the pause that a test wants in it."""

    def __init__(self, tables, pauses_s):
        self.now_s = START_S
        self.steps = 0
        self.is_ready = True
        self.rig = SimpleNamespace(name="a rig", vehicles=("alpha",))
        self.launcher = SimpleNamespace(endpoint="tcp/127.0.0.1:1", waiting_for=[], greetings=[])
        self.monitor = Monitor(tables, ("alpha",))
        self.started_s = START_S
        self._pauses_s = pauses_s

    def start(self, is_unwanted):
        assert not is_unwanted()

    def check_start(self):
        pass

    def step(self, for_s):
        self.steps += 1
        stood_s = self._pauses_s.get(self.steps, 0.0)
        self.now_s += for_s + stood_s
        return stood_s

    def close(self):
        pass


def ends_after(monkeypatch, duration_s, pauses_s):
    """How long a run of this duration takes, s."""
    live = FakeLive(own_tables(), pauses_s)
    monkeypatch.setattr(live_view, "time", SimpleNamespace(monotonic=lambda: live.now_s))
    monkeypatch.setattr(live_view.signal, "signal", lambda *_: None)
    monkeypatch.setattr(live_view, "stdin_descriptor", lambda: -1)
    run_live(live, duration_s, headless=True)
    return live.now_s - START_S


@pytest.mark.parametrize(
    ("pauses_s", "taken_s"),
    [
        ({}, 5.0 + REFRESH_S),
        ({4: 60.0}, 65.0 + REFRESH_S),
        ({4: 60.0, 8: 30.0}, 95.0 + REFRESH_S),
        ({20: 60.0}, 60.0 + 20 * REFRESH_S + WAKING_S),  # just before its end: time to wake up
        ({1: 60.0}, 65.0 + REFRESH_S),  # before it was ready
    ],
)
def test_the_duration_is_longer_by_a_pause(monkeypatch, pauses_s, taken_s):
    assert ends_after(monkeypatch, 5.0, pauses_s) == pytest.approx(taken_s, abs=REFRESH_S / 2)
