"""Every folder of `groundstation demo data` is made, and every command that it names is tried on it."""

import csv
import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

from drivers.laboratory.demo_data import demo_kinds
from groundstation.cli.main import call

ROOT = Path(__file__).parents[2]
KINDS = {kind.name: kind for kind in demo_kinds()}
TRIALS = [(name, command) for name, kind in KINDS.items() for command in kind.commands]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo") / "try"
    assert call(["demo", "data", str(folder)]) == 0
    return folder


def table(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def solved(folder):
    answers, truth = table(folder / "answers.csv"), table(folder / "truth.csv")
    assert [row["frame"] for row in answers] == [row["frame"] for row in truth]
    for found, true in zip(answers, truth, strict=True):
        assert found["fix"] == "1"
        for axis in ("x_m", "y_m"):
            assert abs(float(found[axis]) - float(true[axis])) < 5.0 * float(found[f"std_{axis}"]) < 0.002


def surveyed(folder):
    stars, truth = table(folder / "ceiling.csv"), table(folder / "ceiling_truth.csv")
    place = np.array([[float(row["x_m"]), float(row["y_m"])] for row in truth])
    off = [np.hypot(*(place - (float(s["x_m"]), float(s["y_m"]))).T).min() for s in stars]
    assert len(stars) > 100
    assert max(off) < 0.01  # as well as the tape fixes the table
    assert json.loads((folder / "found.json").read_text())["ceiling_height_above_camera_m"] == pytest.approx(
        2.2, abs=0.01
    )


def seen_from_above(folder):
    truth = {(row["frame"], row["vehicle"]): row for row in table(folder / "truth.csv")}
    answers = table(folder / "answers.csv")
    fixes = [row for row in answers if row["fix"] == "1"]
    assert len(fixes) > 0.8 * len(answers) == 0.8 * len(truth)
    for row in fixes:
        true = truth[row["frame"], row["vehicle"]]
        assert abs(float(row["x_m"]) - float(true["x_m"])) < 5.0 * float(row["std_x_m"]) < 0.01


def estimated(name):
    def check(folder):
        truth = np.array([[float(v) for v in row.values()] for row in table(folder / "truth.csv")])
        rows = table(folder / name)[2000::50]
        t_s = np.array([float(row["t_s"]) for row in rows])
        for column, axis in ((1, "x_m"), (2, "y_m")):
            off = [float(row[axis]) for row in rows] - np.interp(t_s, truth[:, 0], truth[:, column])
            sigma = np.array([float(row[f"std_{axis}"]) for row in rows])
            assert np.percentile(np.abs(off / sigma), 95) < 3.0
            assert np.sqrt(np.mean(off**2)) < 0.005
        used = [int(row["used"]) for row in table(folder / "fixes.csv")]
        assert sum(used) > 0.9 * len(used)

    return check


def value_of(name, key, want, within):
    def check(folder):
        found = tomllib.loads((folder / name).read_text())[key]
        assert abs(found["value"] - want) < within, found
        if "std" in found:
            assert 0.0 < found["std"] < within

    return check


def mounted(folder):
    for key, want in (("mount_offset_x", -0.024), ("mount_offset_y", 0.022)):
        found = tomllib.loads((folder / "mount.toml").read_text())
        name = next(name for name in found if name.startswith("mount_offset") and name[13] == key[13])
        assert abs(found[name]["value"] - want) < 0.001, found[name]


RIGHT = {
    "star-tracker solve {here} --out {here}/answers.csv": solved,
    "star-tracker survey {here} --out {here}/ceiling.csv --camera-out {here}/found.json": surveyed,
    "star-tracker overhead {here} --out {here}/answers.csv": seen_from_above,
    "fusion run {here} --out {here}/estimate.csv": estimated("estimate.csv"),
    "fusion run {here} --out {here}/smoothed.csv --smooth": estimated("smoothed.csv"),
    "calibrate board {here} --squares 9x6 --square-mm 30 --out {here}/lens.toml": value_of(
        "lens.toml", "fx", 600.0, 3.0
    ),
    "calibrate overhead {here} --out {here}/pose.toml --camera-out {here}/found.json": value_of(
        "pose.toml", "z_m", 2.6, 0.02
    ),
    "calibrate delay {here} --out {here}/delay.toml --guess-s 0.6": value_of(
        "delay.toml", "delay", 0.6, 0.005
    ),
    "calibrate allan {here} --out {here}/noise.toml --plot {here}/noise.png": value_of(
        "noise.toml", "omega_random_walk", 1.745e-3 / 1000**0.5, 2e-5
    ),
    "calibrate mount {here} --out {here}/mount.toml --first-heading-deg 0": mounted,
}
"""What must come out, where the folder holds the truth; of the others that they end well."""


@pytest.mark.parametrize(("name", "command"), TRIALS, ids=lambda words: words.partition(" --out")[0])
def test_every_command_that_a_folder_names_works_on_it(made, name, command):
    assert call(command.format(here=made / name).split()) == 0
    check = RIGHT.get(command)
    if check is not None:
        check(made / name)


def test_every_check_is_of_a_command_that_is_there():
    assert set(RIGHT) <= {command for _, command in TRIALS}


def test_the_same_seed_makes_the_same_files(made, tmp_path):
    assert call(["demo", "data", str(tmp_path / "again"), "--only", "rest", "--only", "board"]) == 0
    for name in ("rest/imu.csv", "board/frames/00003.png"):
        assert (tmp_path / "again" / name).read_bytes() == (made / name).read_bytes()
    assert sorted(path.name for path in (tmp_path / "again").iterdir()) == ["board", "rest"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--only", "moon"], "--only is 'moon', expected one of ceiling, sweep"),
        (["--seed", "-1"], "--seed"),
    ],
)
def test_what_cannot_be_made_is_refused(tmp_path, words, sentence, capsys):
    assert call(["demo", "data", str(tmp_path / "a"), *words]) == 2
    assert sentence in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_nothing_is_written_over_and_no_file_is_taken_for_a_folder(made, tmp_path, capsys):
    assert call(["demo", "data", str(made)]) == 2
    assert "is already there" in capsys.readouterr().err
    (tmp_path / "file").touch()
    for target in (tmp_path / "file", tmp_path / "file" / "x", tmp_path / ("x" * 300)):
        assert call(["demo", "data", str(target)]) == 2
        assert "no such folder can be made" in capsys.readouterr().err


def test_a_full_disk_is_one_sentence_and_leaves_nothing(tmp_path):
    script = (
        "import resource; from groundstation.cli.main import main;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)); main()"
    )
    for kind in ("rest", "board"):
        words = [sys.executable, "-c", script, "demo", "data", str(tmp_path / "try"), "--only", kind]
        done = subprocess.run(words, capture_output=True, text=True, check=False, cwd=ROOT)
        assert done.returncode == 2
        assert (
            done.stderr == f"groundstation: {tmp_path / 'try' / kind}: cannot be written (File too large).\n"
        )
        assert not list(tmp_path.iterdir())


def test_every_kind_is_named_in_the_docs():
    page = (ROOT / "docs" / "how_to" / "try_on_files.md").read_text()
    for name, command in TRIALS:
        assert f"`try/{name}`" in page
        assert f"groundstation {command.format(here=f'try/{name}')}" in page


OUT = [(name, command) for name, command in TRIALS if "--out" in command]


@pytest.mark.parametrize(("name", "command"), OUT, ids=lambda words: words.partition(" --out")[0])
def test_no_command_begins_before_it_knows_that_it_can_write(made, tmp_path, name, command, capsys):
    (tmp_path / "file").touch()
    os.mkfifo(tmp_path / "pipe")
    before = sorted(tmp_path.rglob("*"))
    for target in (
        tmp_path,
        tmp_path / "file" / "x",
        tmp_path / "nowhere" / "x",
        tmp_path / "pipe",
        tmp_path / ("x" * 300),
        Path("/proc/nothing_can_be_written_here"),
    ):
        words = command.format(here=made / name).split()
        words[words.index("--out") + 1] = str(target)
        capsys.readouterr()
        assert call(words) == 2
        reported = capsys.readouterr().err
        assert str(target)[:60] in reported
        assert reported.count("\n") == 1, reported
        assert sorted(tmp_path.rglob("*")) == before


def test_a_name_as_long_as_the_disk_takes_is_written(made, tmp_path):
    long = tmp_path / f"{'x' * 246}.toml"
    assert call(["calibrate", "zero-offset", str(made / "rest"), "--out", str(long)]) == 0
    assert [path.name for path in tmp_path.iterdir()] == [long.name]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "command"), TRIALS, ids=lambda words: words.partition(" --out")[0])
def test_every_command_works_where_the_terminal_knows_ascii_only(made, name, command):
    words = [sys.executable, "-m", "groundstation", *command.format(here=made / name).split()]
    plain = {"LC_ALL": "C", "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    done = subprocess.run(words, capture_output=True, check=False, cwd=ROOT, env=os.environ | plain)
    said = (done.stdout + done.stderr).decode("ascii")  # raises where another sign got through
    assert done.returncode == 0, said
    assert "Traceback" not in said
