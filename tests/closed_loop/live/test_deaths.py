"""Every process may die or hang: valves close, the others fly on, it comes back and flies again."""

import itertools
import os
import signal
import time
from pathlib import Path

import pytest

from groundstation.cli.replay import _factory
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.stars.messages import StarFix
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveStatus
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.rig.read import parse_rig
from groundstation.runners.replay import ReplayRunner

pytestmark = pytest.mark.slow

RIGS = Path(__file__).parents[3] / "examples" / "rigs"


def fly_and(launch, rig, name, number):
    """Fly, send a signal to a process, wait for its return; the run and its new process number."""
    run = launch(rig)
    run.wait_until_flying()
    run.wait_for("alpha", "flying", "armed")
    run.forget()
    old = run.pids()[name]
    os.kill(old, number)
    return run, old


def of(path, kind, vehicle):
    with Recording(path) as recording:
        return [row.payload for row in recording.delivered([kind], [vehicle])]


def replayed(path, rig):
    with Recording(path) as recording:
        return ReplayRunner(recording, _factory(parse_rig(recording.info.rig_toml, rig))).run()


def longest_silence_s(payloads):
    stamps = [payload.stamp_ns for payload in payloads]
    return max(b - a for a, b in itertools.pairwise(stamps)) * 1e-9


@pytest.mark.provokes("commands_restarted")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_without_commands_the_valve_node_closes_and_the_vehicle_brakes_or_lands_and_flies_again(
    launch, two_drawn, number
):
    run, _ = fly_and(launch, two_drawn, "commands", number)
    run.wait_for("commands was ended by SIGKILL; starting it again")
    run.wait_for("alpha: FAULT commands_restarted")
    run.wait_for("alpha: flying")
    run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    for vehicle in ("alpha", "beta"):
        modes = [row.mode for row in of(run.recording, Supervision, vehicle)]
        assert "braking" in modes
        assert any("commands_restarted" in row.ids for row in of(run.recording, Faults, vehicle))
        assert longest_silence_s(of(run.recording, VehicleState, vehicle)) < 1.0  # its loop went on


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_one_vehicles_loop_dies_the_other_flies_on_and_it_flies_again(launch, two_drawn, number):
    run, _ = fly_and(launch, two_drawn, "alpha_flight", number)
    run.wait_for("alpha_flight was ended by SIGKILL; starting it again")
    run.wait_for("alpha/imu: open")
    for _ in range(4):
        run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    assert longest_silence_s(of(run.recording, VehicleState, "alpha")) > 0.5
    assert of(run.recording, VehicleState, "alpha")[-1].status == "flying"
    assert longest_silence_s(of(run.recording, VehicleState, "beta")) < 1.0
    assert not any(status.dead_man for status in of(run.recording, ValveStatus, "beta")[200:])


def test_the_station_may_die_without_touching_the_flight(launch, two_drawn):
    run, _ = fly_and(launch, two_drawn, "station", signal.SIGKILL)
    run.wait_for("station was ended by SIGKILL; starting it again")
    run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    for vehicle in ("alpha", "beta"):
        assert longest_silence_s(of(run.recording, VehicleState, vehicle)) < 1.0
        assert not any(status.dead_man for status in of(run.recording, ValveStatus, vehicle)[200:])


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_dead_recorder_loses_nothing_that_was_written_and_goes_on_in_another_file(
    launch, two_drawn, number
):
    run, _ = fly_and(launch, two_drawn, "recorder", number)
    run.wait_for("recorder was ended by SIGKILL; starting it again")
    for _ in range(3):
        run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    second = run.recording.with_stem("run_1")
    assert longest_silence_s(of(second, VehicleState, "alpha")) < 1.0
    whole = run.folder / "whole.mcap"
    recover(run.recording.with_name("run.mcap.part"), whole)
    assert len(of(whole, VehicleState, "alpha")) > 50
    assert any("not finished" in line for line in run.lines)


def test_the_sky_may_die_while_the_vehicle_flies_on_its_imu_and_sees_again(launch, tmp_path):
    text = (RIGS / "two_mock_ups.toml").read_text()
    text = text.replace("../../calibration", str(RIGS.parents[1] / "calibration"))
    rig = tmp_path / "rig.toml"
    short_rest = "[mock_ups.standard.fusion]\nrest_s = 2.0\n\n[vehicles.alpha]"
    rig.write_text(text.replace("[vehicles.alpha]", short_rest))
    run, _ = fly_and(launch, rig, "alpha_sky", signal.SIGKILL)
    run.wait_for("alpha_sky was ended by SIGKILL; starting it again")
    run.wait_for("alpha/star_camera: open")
    for _ in range(4):
        run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    gap_s = longest_silence_s(of(run.recording, StarFix, "alpha"))
    assert gap_s > 3 / 15, "the sky did not fall silent for even three pictures: was it killed?"
    assert longest_silence_s(of(run.recording, StarFix, "beta")) < 1.0
    for vehicle in ("alpha", "beta"):
        assert longest_silence_s(of(run.recording, VehicleState, vehicle)) < 1.0
        assert of(run.recording, VehicleState, vehicle)[-1].status == "flying"


def test_the_fork_server_may_die_and_what_dies_after_it_is_started_again(launch, two_drawn):
    run, _ = fly_and(launch, two_drawn, "fork_server", signal.SIGKILL)
    run.wait_for("the fork server has ended")
    run.wait_for("alpha", "flying", "armed")
    run.forget()
    os.kill(run.pids()["alpha_flight"], signal.SIGKILL)
    run.wait_for("alpha_flight was ended by SIGKILL; starting it again")
    run.wait_for("alpha/imu: open")
    run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    assert longest_silence_s(of(run.recording, VehicleState, "beta")) < 1.0


def test_a_launcher_that_was_paused_does_not_take_its_own_silence_for_that_of_others(launch, two_drawn):
    run = launch(two_drawn)
    run.wait_until_flying()
    before = run.pids()
    os.kill(run.process.pid, signal.SIGSTOP)
    time.sleep(5.0)  # what a person does with Ctrl-Z and fg
    run.forget()
    os.kill(run.process.pid, signal.SIGCONT)
    run.wait_for("alpha", "flying", "armed")
    assert run.pids() == before
    assert not any("hangs" in line or "starting it again" in line for line in run.lines)
    run.end_in_order()


def test_a_dead_laboratory_is_started_again_with_every_process(launch, two_drawn):
    run, old = fly_and(launch, two_drawn, "laboratory", signal.SIGKILL)
    run.wait_for("the laboratory was ended by SIGKILL: starting it again")
    run.wait_until_flying()
    assert run.pids()["laboratory"] != old
    run.end_in_order()


def test_a_recording_with_a_death_in_it_replays_bit_for_bit(launch, two_drawn):
    run, _ = fly_and(launch, two_drawn, "alpha_flight", signal.SIGKILL)
    run.wait_for("alpha/imu: open")
    for _ in range(3):
        run.wait_for("alpha", "flying", "armed")
    assert run.request("alpha", "go_to", "-0.5", "-0.1", "10").returncode == 0
    refused = run.request("alpha", "go_to", "5", "0", "0")
    assert refused.returncode == 1
    assert "outside the part of the table" in refused.stdout
    run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    report = replayed(run.recording, two_drawn)
    assert [(row.noun, row.owner, str(row.first)) for row in report.results if not row.agrees] == []
    assert not report.missing_inputs
    assert not report.refused


@pytest.mark.provokes("clock_jumped")
def test_a_recording_of_a_rig_that_was_paused_whole_replays_bit_for_bit(launch, two_drawn):
    run = launch(two_drawn)
    run.wait_until_flying()
    pids = run.every_pid()
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    time.sleep(3.0)  # Ctrl-Z and fg, of all processes this time
    run.forget()
    for pid in pids:
        os.kill(pid, signal.SIGCONT)
    run.wait_for("alpha: FAULT clock_jumped")
    run.wait_for("alpha", "flying", "armed")
    run.end_in_order()
    report = replayed(run.recording, two_drawn)
    assert [(row.noun, row.owner, str(row.first)) for row in report.results if not row.agrees] == []
    assert not report.missing_inputs
