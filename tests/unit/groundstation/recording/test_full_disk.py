"""A disk that fills up while a recording is written: one sentence, from whichever command writes it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.cli.main import call

ROOT = Path(__file__).parents[4]
RIG = ROOT / "examples" / "rigs" / "drawn_fixes.toml"
WITH_A_LIMIT = (
    "import resource, sys; from groundstation.cli.main import main;"
    "resource.setrlimit(resource.RLIMIT_FSIZE, ({0}, {0})); main()"
)


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "run.mcap"
    assert call(["run", str(RIG), "--lockstep", "--duration", "2", "--record", str(path)]) == 0
    return path


@pytest.mark.parametrize("limit", [100, 40_000])
@pytest.mark.parametrize("command", ["replay", "run", "recover"])
def test_a_full_disk_is_one_sentence(command, limit, flight, tmp_path):
    out = tmp_path / "out.mcap"
    words = {
        "replay": ["replay", flight, "--out", out],
        "run": ["run", RIG, "--lockstep", "--duration", "2", "--record", out],
        "recover": ["recording", "recover", flight, "--out", out],
    }[command]
    done = subprocess.run(
        [sys.executable, "-c", WITH_A_LIMIT.format(limit), *map(str, words)],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    is_begun = (command, limit) == ("run", 40_000)  # a run that was begun ended otherwise than it should
    assert done.returncode == (1 if is_begun else 2)
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"groundstation: {out}")
    assert "File too large" in line
    assert not out.exists()
    left = [path.name for path in tmp_path.iterdir()]
    assert left == (["out.mcap.part"] if is_begun else [])


@pytest.mark.parametrize(
    ("words", "out"),
    [
        (["recording", "film", "{}", "--speed", "5", "--out"], "out.avi"),
        (["recording", "export", "{}", "--csv"], "tables"),
        (["report", "{}", "--out"], "report"),
        (["recording", "cut", "{}", "--out"], "out.mcap"),
    ],
    ids=lambda given: " ".join(given[:2]) if isinstance(given, list) else given,
)
def test_what_a_full_disk_does_not_take_leaves_nothing_and_names_what_was_asked_for(
    words, out, flight, tmp_path
):
    target = tmp_path / out
    if target.suffix == ".avi":
        target.write_text("before")
    done = subprocess.run(
        [sys.executable, "-c", WITH_A_LIMIT.format(20_000), *(word.format(flight) for word in words), target],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 2
    line = done.stderr.splitlines()[-1]
    assert line.startswith(f"groundstation: {target}")
    assert "Traceback" not in done.stderr
    assert ".part" not in line
    assert [path.name for path in tmp_path.iterdir()] == ([out] if target.suffix == ".avi" else [])
    assert target.suffix != ".avi" or target.read_text() == "before"
