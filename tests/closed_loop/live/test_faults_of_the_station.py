"""What goes wrong with the station in flight is named: processes that starve or hang, a full memory."""

import os
import resource
import signal
import time

import pytest

from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.recording.reader import Recording

pytestmark = pytest.mark.slow

STARVED_S = 0.35
"""Longer than a tick may be late, shorter than the clock may seem to stand still."""


def of(path, kind, vehicle="alpha"):
    with Recording(path) as recording:
        return [row.payload for row in recording.delivered([kind], [vehicle])]


def flying(launch, rig):
    run = launch(rig)
    run.wait_until_flying()
    run.wait_for("alpha", "flying", "armed")
    run.forget()
    return run


@pytest.mark.provokes("cpu_starved")
def test_a_command_process_that_gets_no_processor_for_a_while_says_so_and_flies_on(launch, two_drawn):
    run = flying(launch, two_drawn)
    pid = run.pids()["commands"]
    os.kill(pid, signal.SIGSTOP)
    time.sleep(STARVED_S)  # what the test is about: a stopped process for so long, and nothing to wait for
    os.kill(pid, signal.SIGCONT)
    line = run.wait_for("alpha: FAULT cpu_starved")
    assert "ms late" in line
    run.wait_for("alpha: fault cpu_starved is gone")
    run.wait_for("alpha", "flying", "armed")
    assert run.pids()["commands"] == pid
    run.end_in_order()
    rows = of(run.recording, Faults)
    assert any("cpu_starved" in row.ids for row in rows)
    assert "cpu_starved" not in rows[-1].ids
    assert of(run.recording, Supervision)[-1].mode in {"flying", "landing", "landed", "resting"}


@pytest.mark.provokes("memory_lost")
def test_a_stop_that_cannot_be_kept_is_said_until_it_can_be_kept_again(launch, two_drawn):
    run = flying(launch, two_drawn)
    pid = run.pids()["commands"]
    before = resource.prlimit(pid, resource.RLIMIT_FSIZE, (100, resource.RLIM_INFINITY))  # as a full disk
    assert run.request("alpha", "brake").returncode == 0
    line = run.wait_for("alpha: FAULT memory_lost")
    assert "cannot be written" in line
    resource.prlimit(pid, resource.RLIMIT_FSIZE, before)
    run.wait_for("alpha: fault memory_lost is gone")
    assert run.request("alpha", "resume").returncode == 0
    run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    assert not any("starting it again" in line or "Traceback" in line for line in run.lines)


@pytest.mark.provokes("recorder_down")
def test_a_recorder_that_hangs_is_named_before_it_is_killed(launch, two_drawn):
    run = flying(launch, two_drawn)
    pid = run.pids()["recorder"]
    os.kill(pid, signal.SIGSTOP)
    assert "status" in run.wait_for("alpha: FAULT recorder_down")
    os.kill(pid, signal.SIGCONT)
    run.wait_for("alpha: fault recorder_down is gone")
    run.wait_for("alpha", "flying", "armed")
    assert run.pids()["recorder"] == pid
    run.end_in_order()
    rows = of(run.recording, Faults)
    assert any("recorder_down" in row.ids for row in rows)
    assert "recorder_down" not in rows[-1].ids
    assert {row.mode for row in of(run.recording, Supervision)} & {"braking", "lost"} == set()


@pytest.mark.provokes("detector_silent")
def test_a_flight_process_that_hangs_leaves_no_detector_and_the_vehicle_comes_down(launch, two_drawn):
    run = flying(launch, two_drawn)
    pid = run.pids()["alpha_flight"]
    os.kill(pid, signal.SIGSTOP)
    run.wait_for("alpha: FAULT state_silent")
    assert "findings" in run.wait_for("alpha: FAULT detector_silent")
    os.kill(pid, signal.SIGCONT)
    run.wait_for("alpha: flying")
    run.end_in_order()
    modes = [row.mode for row in of(run.recording, Supervision)]
    assert "braking" in modes
    assert not {"detector_silent", "state_silent"} & set(of(run.recording, Faults)[-1].ids)
    assert not any("detector_silent" in row.ids for row in of(run.recording, Faults, "beta"))
