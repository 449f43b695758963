"""A node that raises ends the flight with one sentence that names it; the recording holds what there was."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import NoJournal
from groundstation.cli import run as run_command
from groundstation.cli.main import call
from groundstation.declarations.errors import NodeError
from groundstation.declarations.node import Node
from groundstation.launch import lockstep_run
from groundstation.parts.control.messages import Wrench
from groundstation.parts.imu.messages import Imu, ImuBytes
from groundstation.parts.operation.messages import Diagnostics
from groundstation.recording.reader import Recording
from groundstation.rig.read import load_rig
from groundstation.runners.make_runner import make_runner
from groundstation.runners.slot import Sequences, Slot

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"


@pytest.fixture(scope="module")
def rig_of_one():
    return load_rig(RIG)


CALLS = ("start", "receive", "tick", "stop")
BYTES = Delivered(Envelope(ImuBytes.TOPIC, "alpha", 1, 5), ImuBytes(5, "alpha", b"", math.nan))

PUSH = Wrench(5, "alpha", 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def raised(error):
    def do():
        raise error

    return do


def later(error):
    """A generator, which raises only when it is read."""

    def do():
        yield from ()
        raise error

    return do


WRONG = {
    "an error": (raised(ValueError("boo\nsecond line")), "raised ValueError: boo second line"),
    "an error without text": (raised(ZeroDivisionError()), "raised ZeroDivisionError (traceback with"),
    "an error of a generator": (later(KeyError("x")), "raised KeyError: 'x'"),
    "an exit with code 0": (raised(SystemExit(0)), "raised SystemExit: 0"),
    "an error of thousands of characters": (raised(ValueError("x" * 5000)), "raised ValueError: xxx"),
    "nothing": (lambda: None, "raised TypeError: 'NoneType' object is not iterable"),
    "no message": (lambda: (5,), "raised AttributeError: 'int' object has no attribute 'vehicle'"),
    "what it does not declare": (
        lambda: [Diagnostics(5, "alpha", "", 0, "", (), ())],
        "published Diagnostics, which is not among its outputs",
    ),
}  # fmt: skip


class Rogue(Node):
    """Does something wrong at one of its calls."""

    inputs = (ImuBytes,)
    outputs = (Wrench,)

    def __init__(self, at, do):
        super().__init__("alpha", 100_000_000)
        self._at, self._do = at, do

    def start(self, now_ns):
        return self._do() if self._at == "start" else ()

    def receive(self, message, now_ns):
        return self._do() if self._at == "receive" else ()

    def tick(self, now_ns):
        return self._do() if self._at == "tick" else ()

    def stop(self, now_ns):
        return self._do() if self._at == "stop" else ()


@pytest.mark.parametrize("what", WRONG)
@pytest.mark.parametrize("at", CALLS)
def test_whatever_a_node_raises_leaves_its_slot_as_a_sentence_with_its_key(at, what):
    do, sentence = WRONG[what]
    slot = Slot("alpha/rogue", Rogue(at, do), "flight", NoJournal(), Sequences(), measure=False)
    with pytest.raises(NodeError) as refused:
        slot.receive(BYTES, 5) if at == "receive" else getattr(slot, at)(5)
    assert str(refused.value).startswith("alpha/rogue ")
    assert sentence in str(refused.value)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 500
    assert slot.has_failed
    assert slot.receive(BYTES, 6) == slot.tick(6) == slot.stop(6) == []  # it is called no more


def test_a_vehicle_that_the_rig_lacks_is_published_for_by_nobody(rig_of_one):
    """Its messages would reach nobody, and a flight would go on without a word."""
    for vehicle in ("gamma", ""):
        runner = make_runner(
            rig_of_one, extra_nodes=[Rogue("tick", lambda name=vehicle: [replace(PUSH, vehicle=name)])]
        )
        with pytest.raises(NodeError, match=f"published wrench of a vehicle '{vehicle}', which the rig does"):
            runner.run(200_000_000)
        runner.close()


def test_ctrl_c_is_nobodys_fault():
    slot = Slot("a/b", Rogue("tick", raised(KeyboardInterrupt())), "flight", NoJournal(), Sequences(), False)
    with pytest.raises(KeyboardInterrupt):
        slot.tick(5)


@pytest.mark.parametrize("at", CALLS)
def test_a_flight_ends_with_the_sentence_and_its_recording_is_finished(at, tmp_path, capsys, monkeypatch):
    def with_a_rogue(rig, seed, observers):
        return make_runner(rig, seed, observers, extra_nodes=[Rogue(at, raised(SystemExit(0)))])

    monkeypatch.setattr(lockstep_run, "make_runner", with_a_rogue)
    path = tmp_path / "run.mcap"
    words = ["run", str(RIG), "--lockstep", "--duration", "0.5", "--record", str(path)]
    assert call(words) == 1
    written = capsys.readouterr()
    (line,) = written.err.splitlines()
    assert line.startswith("groundstation: extra/Rogue_0 of the package ")
    assert "raised SystemExit: 0 (traceback with --debug or GROUNDSTATION_DEBUG=1)" in line
    assert f"recording: {path}" in written.out
    with Recording(path) as recording:
        assert recording.has(Imu, "alpha") == (at in ("tick", "stop"))
        assert (recording.stop_ns >= 500_000_000) == (at == "stop")


def test_the_others_stop_in_good_order_and_the_first_fault_is_named(rig_of_one):
    stopped = []

    class Good(Node):
        def receive(self, message, now_ns):
            return ()

        def stop(self, now_ns):
            stopped.append(now_ns)
            return ()

    nodes = [
        Rogue("tick", raised(ValueError("first"))),
        Rogue("stop", raised(ValueError("second"))),
        Good(""),
    ]
    runner = make_runner(rig_of_one, extra_nodes=nodes)
    with pytest.raises(NodeError, match=r"extra/Rogue_0 .*first"):
        runner.run(500_000_000)
    runner.close()
    assert stopped == [100_000_000]


def test_a_node_that_fails_to_stop_is_named_once_the_others_have_stopped(rig_of_one):
    nodes = [Rogue("stop", raised(ValueError("first"))), Rogue("stop", raised(ValueError("second")))]
    runner = make_runner(rig_of_one, extra_nodes=nodes)
    runner.run(100_000_000)
    with pytest.raises(NodeError, match=r"extra/Rogue_0 .*first"):
        runner.close()


def test_a_payload_that_does_not_fit_its_fields_is_named(rig_of_one, tmp_path, capsys, monkeypatch):
    def with_a_rogue(rig, seed, observers):
        wrong = Wrench(5, "alpha", "x", 0.0, 0.0, 0.0, 0.0, 0.0)
        return make_runner(rig, seed, observers, extra_nodes=[Rogue("tick", lambda: [wrong])])

    monkeypatch.setattr(lockstep_run, "make_runner", with_a_rogue)
    words = ["run", str(RIG), "--lockstep", "--duration", "0.5", "--record", str(tmp_path / "run.mcap")]
    assert call(words) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "Wrench(stamp_ns=5, vehicle='alpha', " in line
    assert "does not fit its fields" in line


@pytest.mark.parametrize("where", ["word", "environment"])
def test_the_traceback_is_there_for_who_asks(where, capsys, monkeypatch):
    monkeypatch.setenv("GROUNDSTATION_DEBUG", "1" if where == "environment" else "")

    def fail(path, what):
        raise NodeError("alpha/rogue raised ValueError")

    monkeypatch.setattr(run_command, "read_text", fail)
    assert call(["run", str(RIG), *(["--debug"] if where == "word" else [])]) == 1
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "Traceback (most recent call last):"
    assert lines[-1] == "groundstation: alpha/rogue raised ValueError"
