"""The stop of a live run: from a command line of its own, past a process that dies, and told at the end."""

import json
import os
import signal

import pytest

from groundstation.parts.supervision.messages import StopPress, Supervision
from groundstation.recording.reader import Recording

pytestmark = pytest.mark.slow


def rulings(path, vehicle):
    with Recording(path) as recording:
        return [delivered.payload for delivered in recording.delivered([Supervision], [vehicle])]


def test_stop_all_stops_all_and_only_a_person_lets_them_fly_again(launch, two_drawn):
    run = launch(two_drawn)
    run.wait_until_flying()
    done = run.request("all", "stop", "--as", "anna")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert [line.split(" ")[0] for line in lines] == ["alpha", "beta"]
    assert all("stop: accepted, it is " in line for line in lines)
    done = run.request("all", "land")
    assert [line.partition(": ")[2] for line in done.stdout.splitlines()] == ["land: accepted"] * 2
    for name in ("alpha", "beta"):
        run.rewind()
        run.wait_for(f"{name}: stopped", "by anna")
    assert run.request("alpha", "fly").returncode == 1
    assert run.request("all", "release").returncode == 0
    code, _ = run.end()
    assert code == 0, "what a person stops is no fault"
    with Recording(run.recording) as recording:
        presses = [delivered.payload for delivered in recording.delivered([StopPress])]
    assert {(press.vehicle, press.author) for press in presses} == {("", "anna")}
    assert len({press.press_id for press in presses}) == 1


def test_a_stop_that_is_pressed_while_its_process_is_dead_is_taken_when_it_is_back(launch, two_drawn):
    run = launch(two_drawn)
    run.wait_until_flying()
    os.kill(run.pids()["commands"], signal.SIGKILL)
    done = run.request("all", "stop", "--timeout", "20")
    assert done.returncode == 0, done.stdout + done.stderr
    os.kill(run.pids()["commands"], signal.SIGKILL)  # it is remembered
    run.forget()
    run.wait_for("all processes are ready")
    assert run.request("alpha", "fly").returncode == 1
    run.end()
    for name in ("alpha", "beta"):
        after = rulings(run.recording, name)
        first = next(number for number, ruling in enumerate(after) if ruling.stop_latched)
        lives = [ruling for ruling in after[first:] if ruling.cause != "it has just begun"]
        assert all(ruling.stop_latched for ruling in lives)
        assert "flying" not in {ruling.mode for ruling in after[first:]}


def test_a_run_in_which_a_fault_lands_a_vehicle_tells_it_and_ends_with_code_1(launch, two_drawn, tmp_path):
    run = launch(two_drawn, "--report", str(tmp_path / "report"))
    run.wait_until_flying()
    done = run.inject("alpha", "lost_bytes", "--probability_per_byte", "1", "--for", "8")
    assert done.returncode == 0, done.stdout + done.stderr
    run.wait_for("alpha: landing")
    code, _ = run.end()
    assert code == 1
    assert any(line.startswith("alpha: fault imu_silent from ") for line in run.lines)
    assert any(line.startswith("alpha: LANDED BY A FAULT: ") for line in run.lines)
    found = json.loads((tmp_path / "report" / "report.json").read_text())["vehicles"]
    assert "imu_silent" in {fault["id"] for fault in found["alpha"]["faults"]}
    assert found["alpha"]["landed_by_fault"]
    assert found["alpha"]["closures"] >= 1


def test_one_holds_control_and_anyone_may_stop(launch, two_drawn):
    run = launch(two_drawn)
    run.wait_until_flying()
    assert run.request("all", "take_control", "300", "--as", "anna").returncode == 0
    refused = run.request("alpha", "go_to", "0", "0", "0", "--as", "bob")
    assert refused.returncode == 1
    assert "control is held by anna for another 0:0" in refused.stdout
    run.forget()
    os.kill(run.pids()["station"], signal.SIGKILL)  # who granted it
    run.wait_for("all processes are ready")
    taken = run.request("alpha", "take_control", "300", "--as", "bob")
    assert taken.returncode == 1
    assert "control is held by anna for another 0:0" in taken.stdout
    assert run.request("alpha", "go_to", "-0.5", "0", "0", "--as", "anna").returncode == 0
    assert run.request("alpha", "give_control", "bob", "--as", "anna").returncode == 0
    assert run.request("alpha", "go_to", "-0.6", "0", "0", "--as", "anna").returncode == 1
    assert run.request("all", "stop", "--as", "anna").returncode == 0
    run.end()
