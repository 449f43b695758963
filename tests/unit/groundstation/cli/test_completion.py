"""Completion as a real bash asks for it, offline, and what the installer writes."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.cli.completion import ASKED, typed
from groundstation.cli.main import COMMANDS

BASH = shutil.which("bash")
BIN = Path(sys.executable).parent
needs_bash = pytest.mark.skipif(BASH is None, reason="there is no bash here")
HEAVY = ("numpy", "cv2", "zenoh", "scipy", "matplotlib")


def bash(home, script):
    path = os.pathsep.join([str(BIN), os.environ.get("PATH", "")])
    return subprocess.run(
        [BASH, "--norc", "-c", script], capture_output=True, text=True, check=False, timeout=60,
        env={"PATH": path, "HOME": str(home), "XDG_RUNTIME_DIR": str(home), "LANG": "C.UTF-8"},
    )  # fmt: skip


def completed(home, *words):
    """What bash offers behind these words, by the script that we show."""
    line = " ".join(f"'{word}'" for word in ("groundstation", *words))
    script = (
        'source "$HOME/completion.sh"\n'
        f"COMP_WORDS=({line}); COMP_CWORD={len(words)}\n"
        '_groundstation_completion groundstation; printf "%s\\n" "${COMPREPLY[@]}"'
    )
    done = bash(home, script)
    assert done.stderr == ""
    return done.stdout.split()


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    folder = tmp_path_factory.mktemp("home")
    done = bash(folder, "groundstation --show-completion; true")
    assert "complete -o default -F" in done.stdout, done.stderr
    (folder / "completion.sh").write_text(done.stdout)
    return folder


@pytest.mark.slow
@needs_bash
def test_commands_options_and_members_of_groups(home):
    assert completed(home, "rep") == ["replay", "report", "reproduce"]
    assert set(completed(home, "")) >= set(COMMANDS)
    assert "--lockstep" in completed(home, "run", "--lo")
    assert completed(home, "star-tracker", "so") == ["solve"]
    assert completed(home, "calibrate", "table-m") == ["table-map"]
    assert completed(home, "nothing-like-it", "--x") == []


@pytest.mark.slow
@needs_bash
def test_topics_and_fields_of_rigs_that_run(home, fake_run):
    shutil.copytree(fake_run.folder / "groundstation", home / "groundstation", dirs_exist_ok=True)
    assert completed(home, "watch", "alpha/stat") == ["alpha/state"]
    assert completed(home, "watch", "beta/state.he") == ["beta/state.heading_rad"]
    shutil.rmtree(home / "groundstation")


@pytest.mark.slow
@needs_bash
def test_the_installer_writes_into_the_home_folder_alone(tmp_path):
    done = bash(tmp_path, "groundstation --install-completion; true")
    assert "completion installed" in done.stdout, done.stderr
    assert "groundstation" in (tmp_path / ".bashrc").read_text()
    assert list(tmp_path.rglob("*groundstation*.sh"))


def test_completing_a_command_loads_nothing_heavy():
    code = (
        "import os, sys; from groundstation.cli.main import call\n"
        "call([])\n"
        f"sys.exit(' '.join(name for name in {HEAVY} if name in sys.modules) or 0)"
    )
    env = os.environ | {ASKED: "complete_bash", "COMP_WORDS": "groundstation\nsta", "COMP_CWORD": "1"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, env=env)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["status", "star-tracker"]


def test_what_shells_hand_over():
    assert typed({}) is None
    assert typed({ASKED: "complete_bash", "COMP_WORDS": "groundstation\nrun\n'a b"}) == ["run", "'a", "b"]
    assert typed({ASKED: "complete_zsh", "_TYPER_COMPLETE_ARGS": "groundstation wat"}) == ["wat"]
    assert typed({ASKED: "complete_fish"}) == []
