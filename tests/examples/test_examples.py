"""The examples run as a reader would run them, and the documentation leads where it says."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import groundstation.frames
from firmware_emulator.failures import FAILURE_KINDS
from groundstation.rig.plan import processes_of
from groundstation.rig.read import load_rig, parse_rig

ROOT = Path(__file__).parents[2]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])


def run(*words, cwd=ROOT):
    done = subprocess.run(
        [sys.executable, *map(str, words)],
        cwd=cwd,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """12 s of one mock-up with drawn fixes, made by the command line."""
    path = tmp_path_factory.mktemp("examples") / "run.mcap"
    run(
        *("-m", "groundstation", "run", "examples/rigs/drawn_fixes.toml"),
        *("--lockstep", "--duration", "12", "--record", path),
    )
    return path


def test_the_guard_opens_only_for_a_fresh_new_pulse_of_an_armed_vehicle():
    lines = run("examples/ask_the_guard.py").splitlines()
    opened = [int(re.search(r"valve 0 for +(\d+) ms", line)[1]) for line in lines]
    assert opened == [0, 0, 0, 50, 30, 50, 30, 0, 0, 50]


def test_a_picture_is_solved_to_a_tenth_of_a_millimetre():
    off_mm = float(re.search(r"truth by ([\d.]+) mm", run("examples/solve_a_picture.py"))[1])
    assert off_mm < 0.1  # one pixel is 3.7 mm; 30 stars at a few hundredths of a pixel each


def test_the_bytes_of_a_recording_parse_again_without_loss(recording):
    reported = run("examples/parse_again.py", recording)
    assert "version 2" in reported
    assert int(re.search(r"(\d+) samples", reported)[1]) > 12 * 100 - 10
    assert "frames_lost" not in reported


def test_a_recording_compares_with_truth(recording):
    reported = run("examples/compare_with_truth.py", recording)
    x_mm, y_mm = (float(number) for number in re.findall(r"[xy] ([\d.]+) mm", reported)[:2])
    assert x_mm < 5.0  # fixes of 1 mm, one each 0.65 s, carried by the IMU between them
    assert y_mm < 5.0


@pytest.mark.slow
def test_the_tour_leaves_the_first_corner(tmp_path):
    path = tmp_path / "square.mcap"
    run("examples/fly_a_square.py", path, "--duration", "25")
    assert path.exists()
    assert "alpha: RMS error" in run("examples/compare_with_truth.py", path)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_of_a_page_leads_to_a_file(page):
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if not target.startswith(("http://", "https://", "#")):
            assert (page.parent / target.partition("#")[0]).exists(), target


def test_every_file_that_the_readme_names_is_there():
    for named in re.findall(
        r"(?<![\w/])(?:examples|tools|docs|calibration)/[\w/.]+\.\w+", PAGES[0].read_text()
    ):
        assert (ROOT / named).exists(), named


def test_the_page_of_frames_holds_the_table_of_the_code():
    rows = re.findall(r"^(\w+)  +(.+?)  +(.+)$", groundstation.frames.__doc__, flags=re.MULTILINE)
    page = (ROOT / "docs" / "frames.md").read_text()
    for name, origin, axes in rows[1:]:  # the first is the table's head
        assert f"| `{name}` | {origin.strip()} | {axes.strip()} |" in page


def test_the_page_of_benchmarks_keeps_its_marks():
    page = (ROOT / "docs" / "benchmarks.md").read_text()
    assert page.index("<!-- bench:begin -->") < page.index("<!-- bench:end -->")


@pytest.mark.parametrize(
    "path",
    [*sorted((ROOT / "examples" / "rigs").glob("*.toml")), ROOT / "examples" / "fly_a_square.toml"],
    ids=lambda path: path.stem,
)
def test_every_rig_of_the_examples_makes_a_plan_of_processes(path):
    assert processes_of(load_rig(path))[0] == "commands"


@pytest.mark.parametrize("page", ["README.md", "docs/how_to/real_hardware.md"])
def test_the_changes_for_real_hardware_make_a_rig_without_laboratory(page):
    """What the page takes away stands in the rig of the emulator; what it adds makes a rig that loads."""
    path = ROOT / "examples" / "rigs" / "two_mock_ups.toml"
    changes = re.search(r"```diff\n(.*?)```", (ROOT / page).read_text(), flags=re.DOTALL)[1].splitlines()
    taken = [line[1:] for line in changes if line.startswith("-") and "..." not in line]
    added = [line[1:] for line in changes if line.startswith("+")]
    wired, emulated, _ = path.read_text().partition("[laboratory]\n")
    for line in taken:
        assert line in wired + emulated, line
        wired = wired.replace(f"{line}\n", "")
    before, beta, _ = wired.partition("[vehicles.beta]")
    assert beta
    bus, *devices = added
    rig = parse_rig(f"{bus}\n{before}" + "\n".join(devices), path)
    assert rig.laboratory is None
    assert rig.valve_bus["interface"] == "socketcan"
    assert rig.vehicles["alpha"].imu.startswith("/dev/")


def test_the_page_of_faults_names_every_kind_with_its_parameters():
    rows = (ROOT / "docs" / "how_to" / "break_things.md").read_text().splitlines()
    for kind, row in FAILURE_KINDS.items():
        line = next(line for line in rows if line.startswith(f"| `{kind}` |"))
        assert all(f"`{name}`" in line for name in row.parameters), line
