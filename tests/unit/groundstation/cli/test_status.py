"""What ``groundstation status`` shows of a rig that runs, on 80 columns and as JSON."""

import json
import os
import threading
from dataclasses import replace

import pytest

from groundstation.bus.cdr import ros_fields
from groundstation.cli import status as command
from groundstation.declarations.lease import Lease
from groundstation.launch.running import RunningRig
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.operation.messages import Diagnostics, Latency, RecorderStatus
from groundstation.parts.supervision.messages import Faults, Supervision
from groundstation.parts.valves.messages import ValveStatus

ZEROS = {"string": "", "bool": False, "string[]": (), "float64[]": ()}


def zero(ros):
    if ros in ZEROS:
        return ZEROS[ros]
    if ros.endswith("]"):
        return (0.0,) * int(ros.partition("[")[2][:-1])
    return 0.0 if ros.startswith("float") else 0


def made(kind, vehicle="", **known):
    return kind(0, vehicle, *(known.pop(name, None) or zero(ros) for name, ros in ros_fields(kind)))


def everything(name):
    return (
        made(Supervision, name, mode="flying", cause="it holds its pose", air_on=True),
        made(
            Faults, name, ids=("dead_sky",), whats=("No fix for 7 s.",), details=("",), since_ns=(1.0,),
            responses=("flies on",), advices=("Look.",), gone_ns=(0.0,),
        ),
        made(ValveStatus, name, floating=True, pressure_pa=1.87e7),
        made(VehicleState, name, position_table_m=(0.1, 0.2)),
        made(FusionStatus, name, fix_age_s=0.05),
        made(Latency, name, stages=("bus",), p50_s=(0.0213,), p99_s=(0.0299,)),
    )  # fmt: skip


@pytest.fixture
def publishing(fake_run):
    """Publishes everything, again and again, until the test is over."""
    done = threading.Event()

    def publish():
        rig = (made(Lease), made(RecorderStatus, path="r.mcap", written_bytes=3_000_000, free_bytes=10**11))
        while not done.wait(0.02):
            fake_run.publish(*everything("alpha"), *everything("beta"), *rig)
            fake_run.publish(made(Diagnostics, node="recorder"), owner="recorder")

    thread = threading.Thread(target=publish)
    thread.start()
    yield fake_run
    done.set()
    thread.join()


def test_everything_is_on_one_screen_of_80_columns(publishing, groundstation, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    lines = groundstation("status").output.splitlines()
    assert len(lines) <= 24
    assert max(map(len, lines)) <= 80
    text = "\n".join(lines)
    for words in (
        "a rig (process", "nobody holds it", "3.0 MB, 100 GB free", "187 bar", "flying", "21.3 / 29.9 ms",
        "alpha: flying: it holds its pose", "beta: FAULT dead_sky",
    ):  # fmt: skip
        assert words in text


def test_as_json_it_is_si(publishing, groundstation):
    (rig,) = json.loads(groundstation("status", "--json").output)
    alpha = rig["vehicles"]["alpha"]
    assert (alpha["mode"], alpha["pressure_pa"], alpha["position_table_m"]) == ("flying", 1.87e7, [0.1, 0.2])
    assert rig["recorder"]["free_bytes"] == 10**11
    assert rig["endpoint"] == publishing.run.endpoint


def test_a_rig_that_publishes_nothing_is_shown_as_that(fake_run, groundstation, monkeypatch):
    monkeypatch.setattr(command, "LOOKS_S", 0.1)
    output = groundstation("status").output
    assert "alpha: no ruling was published" in output
    assert "recorder  none" in output


def test_a_recorder_that_was_asked_for_and_stopped_is_not_called_none(fake_run, groundstation, monkeypatch):
    monkeypatch.setattr(command, "LOOKS_S", 0.1)
    monkeypatch.setenv("COLUMNS", "80")
    run = replace(fake_run.run, recording="/somewhere/x.mcap")
    run.announce()
    lines = groundstation("status").output
    assert "recorder  STOPPED: /somewhere/x.mcap" in lines
    assert "nothing has come from it within 0.1 s" in lines
    why = "ended with code 2 (/somewhere/x.mcap.part cannot be written: Permission denied)"
    replace(run, recorder_stop=why).announce()
    lines = groundstation("status").output.splitlines()
    assert why in " ".join(" ".join(lines).split())
    assert max(map(len, lines)) <= 80
    (rig,) = json.loads(groundstation("status", "--json").output)
    assert (rig["recorder"]["is_stopped"], rig["recorder"]["trouble"]) == (True, why)


def test_a_recorder_that_lives_and_writes_nothing_says_why(fake_run, groundstation, monkeypatch):
    monkeypatch.setattr(command, "LOOKS_S", 0.5)
    done = threading.Event()

    def publish():
        while not done.wait(0.02):
            fake_run.publish(made(RecorderStatus, path="r.mcap"))
            fake_run.publish(
                made(Diagnostics, node="recorder", level=2, summary="r.mcap was deleted"), owner="recorder"
            )

    thread = threading.Thread(target=publish)
    thread.start()
    output = groundstation("status").output
    done.set()
    thread.join()
    assert "recorder  STOPPED: r.mcap" in output
    assert "r.mcap was deleted" in output


def test_no_rig_is_no_error(tmp_path, monkeypatch, groundstation):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    shown = groundstation("status")
    assert (shown.exit_code, "no rig is running" in shown.output) == (0, True)
    assert json.loads(groundstation("status", "--json").output) == []


def test_a_rig_that_cannot_be_reached_is_named(tmp_path, monkeypatch, groundstation):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    RunningRig(os.getpid(), "gone", "tcp/127.0.0.1:9", ("alpha",)).announce()
    shown = groundstation("status")
    assert shown.exit_code == 1
    assert "NOT REACHED" in shown.output
