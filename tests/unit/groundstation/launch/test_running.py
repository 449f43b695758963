"""A run that is paused is known as that, and nobody waits for it in vain."""

import os
import signal
import subprocess
import sys

import pytest

from groundstation.cli.main import call
from groundstation.declarations.errors import GroundStationError
from groundstation.launch.asking import ask_each, session_with
from groundstation.launch.running import RunningRig
from groundstation.launch.stop_button import EVERY, press_stop

ENDPOINT = "tcp/127.0.0.1:1"


@pytest.fixture(params=["python", "od) T (d"])
def process(request, tmp_path):
    """A process of this name that waits, as a launcher does."""
    program = tmp_path / request.param
    program.symlink_to(os.path.realpath(sys.executable))
    words = [program, "-c", "import sys; print(flush=True); sys.stdin.read()"]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as started:
        started.stdout.readline()
        yield started
        started.kill()


@pytest.fixture
def run(process, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    announced = RunningRig(process.pid, "a rig", ENDPOINT, ("alpha", "beta"))
    announced.announce()
    return announced


def send(pid: int, number: int) -> None:
    """Send a signal of job control and wait until it has worked."""
    os.kill(pid, number)
    os.waitpid(pid, os.WUNTRACED | os.WCONTINUED)


def test_a_run_is_paused_from_its_stop_to_its_continuation(run):
    assert not run.is_paused
    send(run.pid, signal.SIGSTOP)
    assert run.is_paused
    send(run.pid, signal.SIGCONT)
    assert not run.is_paused


def test_a_run_that_has_ended_is_not_paused(run, process):
    process.kill()
    process.wait()
    assert not run.is_paused


def test_whoever_wants_to_be_let_in_learns_how_to_let_it_go_on(run):
    send(run.pid, signal.SIGSTOP)
    advice = rf"^a rig is paused .* `kill -CONT {run.pid}`, or by `fg`"
    with pytest.raises(GroundStationError, match=advice), session_with(ENDPOINT):
        pass
    with pytest.raises(GroundStationError, match=advice):
        ask_each(ENDPOINT, ("alpha",), "fly", {}, "anna", 60.0)
    with pytest.raises(GroundStationError, match=advice):
        press_stop(ENDPOINT, ("alpha", "beta"), EVERY, "anna", 60.0)


def test_a_paused_run_keeps_nobody_out_of_another_one(run):
    send(run.pid, signal.SIGSTOP)
    with (
        pytest.raises(GroundStationError, match=r"the hub at tcp/127.0.0.1:2 cannot be reached"),
        session_with("tcp/127.0.0.1:2"),
    ):
        pass


@pytest.mark.parametrize("words", [["status"], ["request", "all", "stop"], ["request", "alpha", "fly"]])
def test_the_advice_is_shown_whole_on_a_narrow_terminal(run, words, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "40")
    send(run.pid, signal.SIGSTOP)
    assert call(words) == 1
    shown = "".join(capsys.readouterr())
    assert f"`kill -CONT {run.pid}`, or by `fg` where it was started" in shown
