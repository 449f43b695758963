"""A program outside flies alpha and is killed: it brakes and holds; resume gives it back; and it replays."""

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.cli.main import call
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.outside.messages import OutsideText, OutsideWrench
from groundstation.parts.valves.messages import OutsideControl, ValveDemand, ValveSelection
from groundstation.recording.reader import Recording

CIRCLE = Path(__file__).parents[3] / "examples" / "outside" / "circle.py"

pytestmark = pytest.mark.slow


@pytest.fixture
def circle():
    """Starts the example's client; it is killed at the end of the test, if it has not ended."""
    started = []

    def start(endpoint, *words):
        command = [sys.executable, str(CIRCLE), endpoint, "alpha", "--as", "anna", *words]
        started.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True))
        return started[-1]

    yield start
    for process in started:
        process.kill()
        process.communicate()


def endpoint_of(run):
    return re.search(r"open at (\S+)", run.wait_for("outside: open at"))[1]


def test_a_killed_program_is_braked_for_and_the_vehicle_comes_back(launch, two_drawn, circle, capsys):
    run = launch(two_drawn)
    endpoint = endpoint_of(run)
    run.wait_until_flying()
    client = circle(endpoint, "--duration", "600")
    assert client.stdout.readline() == "anna flies alpha\n"
    for _ in range(3):
        run.wait_for("alpha", "flying", "armed")
    os.kill(client.pid, signal.SIGKILL)
    run.rewind()
    run.wait_for("alpha: FAULT outside_silent", "anna: no wrench for")
    run.forget()
    for _ in range(3):
        run.wait_for("alpha", "holding", "armed")
    refused = run.request("alpha", "resume", "--as", "otto")
    assert (refused.returncode, "control is held by anna" in refused.stdout) == (1, True), refused.stdout
    assert run.request("alpha", "resume", "--as", "anna").returncode == 0
    run.wait_for("alpha: fault outside_silent is gone")
    for _ in range(2):
        run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    with Recording(run.recording) as recording:
        texts = [row.payload for row in recording.messages((OutsideText,))]
        wrenches = [row.payload for row in recording.messages((OutsideWrench,))]
        controls = [row.payload for row in recording.messages((OutsideControl,))]
        chosen = [
            row.payload for row in recording.messages((ValveSelection,)) if row.payload.vehicle == "alpha"
        ]
        demands = [
            row.payload for row in recording.messages((ValveDemand,)) if row.payload.vehicle == "alpha"
        ]
        states = [
            row.payload for row in recording.messages((VehicleState,)) if row.payload.vehicle == "alpha"
        ]
    assert len(texts) > len(wrenches) > 10
    last_ns = wrenches[-1].stamp_ns
    braked = next(each for each in chosen if each.source == "brake" and each.stamp_ns > last_ns)
    assert braked.stamp_ns - last_ns > 0.2e9
    given_back = [(each.author, each.reason) for each in controls if each.author == ""]
    assert given_back == [("", "resumed by anna")], "\n".join(run.lines)
    assert {each.vehicle for each in controls} == {"alpha"}
    flown = [each for each in demands if each.source == "outside"]
    assert any(each.delivered_force_body_n != (0.0, 0.0) for each in flown)
    assert chosen[-1].source in ("controller", "closed")  # closed: the end of the run
    held = [s for s in states if controls[-1].stamp_ns - 1e9 < s.stamp_ns < controls[-1].stamp_ns]
    assert max(abs(speed) for state in held for speed in state.velocity_table_m_s) < 0.02
    assert call(["replay", str(run.recording)]) == 0, capsys.readouterr().out


def test_a_program_that_ends_in_order_gives_the_vehicle_back(launch, two_drawn, circle):
    run = launch(two_drawn)
    endpoint = endpoint_of(run)
    run.wait_until_flying()
    said, _ = circle(endpoint, "--duration", "3").communicate(timeout=60)
    assert "alpha is the controller's again" in said
    run.end_in_order()
    with Recording(run.recording) as recording:
        controls = [row.payload for row in recording.messages((OutsideControl,))]
        chosen = [row.payload.source for row in recording.messages((ValveSelection,))]
    assert controls[-1].reason == "control went to nobody"
    assert "outside" in chosen
