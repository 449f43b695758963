"""A request that cannot be sent is refused in one sentence; runs find each other by their files."""

import json
import os
import pwd
import subprocess
import sys

import pytest

from groundstation.cli.main import call
from groundstation.launch.running import RunningRig, find_running


@pytest.fixture(autouse=True)
def own_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "groundstation"


def refused(capsys, *words):
    assert call(["request", *words]) == 2
    reported = capsys.readouterr()
    assert reported.out == ""
    assert reported.err.count("\n") == 1
    return reported.err


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["alpha", "jump"], "there is no action 'jump' (there are fly, "),
        (["alpha", "go_to", "0.1"], "go_to takes x_m y_m heading_deg, found 1 words"),
        (["alpha", "go_to", "-0.1", "nan", "3"], "finite"),
        (["alpha", "stop"], "no rig is running"),
        (["all", "stop"], "no rig is running"),
        (["all", "fly"], "no rig is running"),
        (["all", "stop", "now"], "stop takes no arguments, found 1 words"),
        (["all", "go_to", "0", "0", "0"], "go_to is asked of one vehicle; all can be asked to stop, land, "),
        (["all", "push", "0", "0", "0", "1"], "push is asked of one vehicle; all can be asked to stop, "),
        (["alpha", "fly", "--as", "x" * 65], "the name of who asks is 65 letters long, expected at most 64"),
        (["alpha", "fly", "--as", "a\nb"], "the name of who asks is 'a\\nb', expected one line"),
        (["alpha", "fly", "override=\x1b[2J"], "fly: override is '\\x1b[2J', expected one line"),
        (["alpha", "stop", "--as", "a\nb"], "no rig is running"),
        (["alpha", "stop", "--pid", "1"], "no rig is running with process 1"),
    ],
)
def test_what_cannot_be_asked_is_refused(words, reason, capsys):
    assert reason in refused(capsys, *words)


@pytest.mark.parametrize("words", [["request", "alpha", "stop"], ["inject", "alpha", "dead_sky"]])
@pytest.mark.parametrize("seconds", ["inf", "1e30", "nan", "0"])
def test_a_wait_without_end_is_refused(words, seconds, capsys):
    assert call([*words, "--timeout", seconds]) == 2
    assert "Invalid value for '--timeout'" in capsys.readouterr().err


def test_a_user_whom_the_machine_has_no_name_for_may_stop_all(capsys, monkeypatch):
    for name in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(pwd, "getpwuid", {}.__getitem__)
    RunningRig(os.getpid(), "one", "tcp/127.0.0.1:1", ("alpha",)).announce()
    assert call(["request", "all", "stop"]) == 1
    assert "the hub at tcp/127.0.0.1:1 cannot be reached" in capsys.readouterr().err


def test_a_parameter_that_is_given_twice_is_refused(capsys):
    assert call(["inject", "alpha", "stuck_open_valve", "--valve", "3", "--valve", "4"]) == 2
    assert capsys.readouterr().err == "groundstation: --valve is given twice\n"


def test_the_vehicle_must_be_flown_by_exactly_one_run(capsys):
    RunningRig(os.getpid(), "one", "tcp/127.0.0.1:1", ("alpha", "beta")).announce()
    RunningRig(os.getppid(), "other", "tcp/127.0.0.1:2", ("alpha",)).announce()
    assert "no vehicle 'gamma' is running" in refused(capsys, "gamma", "stop")
    assert "choose one with --pid" in refused(capsys, "alpha", "stop")


def test_a_run_is_found_while_it_lives_and_forgotten_after(own_folder):
    path = RunningRig(os.getpid(), "one", "tcp/127.0.0.1:1", ("alpha",)).announce()
    dead = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, check=True
    )
    left = own_folder / "dead.json"
    left.write_text(json.dumps({"pid": int(dead.stdout), "rig": "x", "endpoint": "y", "vehicles": []}))
    (own_folder / "torn.json").write_text("{")
    assert [run.rig for run in find_running()] == ["one"]
    assert not left.exists()
    path.unlink()
    assert find_running() == []
