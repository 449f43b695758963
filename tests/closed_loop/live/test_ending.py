"""However a run ends, it ends soon and leaves nothing behind."""

import os
import signal
from pathlib import Path

import pytest

from groundstation.parts.valves.messages import ValveCommand, ValveStatus
from groundstation.recording.reader import Recording

pytestmark = pytest.mark.slow

ANSWERS_NS = 40_000_000
"""A valve node reports each 20 ms what it has received by then."""
RIGS = Path(__file__).parents[3] / "examples" / "rigs"


def newest(path, kind, vehicle):
    with Recording(path) as recording:
        return list(recording.delivered([kind], [vehicle]))[-1].payload


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_run_ends_within_three_seconds_and_leaves_nothing(launch, two_drawn, nothing_left, number):
    run = launch(two_drawn)
    run.wait_until_flying()
    pids = list(run.pids().values())
    assert len(pids) == 7  # the fork server among them
    code, took_s = run.end(number)
    assert code == 0
    assert took_s < 3.0
    nothing_left(pids)
    assert not list((run.folder / "groundstation").glob("*"))
    for vehicle in ("alpha", "beta"):
        last = newest(run.recording, ValveCommand, vehicle)
        assert last.open_mask == 0
        assert last.stop_reason != 255  # the last word is a stop
        status = newest(run.recording, ValveStatus, vehicle)
        # on a busy machine the process ends before the node has answered its last word
        assert status.open_mask == 0 or status.stamp_ns < last.stamp_ns + ANSWERS_NS


def test_a_run_that_is_still_starting_ends_as_soon(launch, nothing_left):
    run = launch(RIGS / "two_mock_ups.toml")
    run.wait_for("starting")
    pids = list(run.pids().values())
    code, took_s = run.end(signal.SIGINT)
    assert code == 0
    assert took_s < 3.0
    nothing_left(pids)


def test_a_duration_ends_by_itself_and_leaves_a_report(launch, two_drawn):
    run = launch(two_drawn, "--duration", "5", "--report", str(two_drawn.parent / "report"))
    assert run.process.wait(60) == 0
    report = two_drawn.parent / "report"
    assert sorted(path.name for path in report.iterdir()) == ["report.html", "report.json"]
    page = (report / "report.html").read_text()
    for title in ("On the table", "Off the setpoint", "Valves and gas", "Fixes", "Latency"):
        assert f"<h2>{title}</h2>" in page


def test_a_killed_launcher_takes_every_process_with_it(launch, two_drawn, nothing_left):
    run = launch(two_drawn)
    run.wait_until_flying()
    pids = list(run.pids().values())
    os.kill(run.process.pid, signal.SIGKILL)
    run.process.wait(10)
    nothing_left(pids)
    last = newest(run.recording, ValveCommand, "alpha")  # the recorder finished its file
    assert last.open_mask == 0
