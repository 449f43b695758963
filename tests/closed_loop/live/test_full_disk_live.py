"""A disk that takes no more of a recording in flight: it is said, and recording goes on elsewhere."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from groundstation.parts.fusion.messages import VehicleState
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.recording.run_files import PART_SUFFIX

ROOT = Path(__file__).parents[3]
RIG = ROOT / "examples" / "rigs" / "drawn_fixes.toml"
LIMIT = 300_000
WITH_A_LIMIT = (
    "import resource; from groundstation.cli.main import main;"
    f"resource.setrlimit(resource.RLIMIT_FSIZE, ({LIMIT}, {LIMIT})); main()"
)


@pytest.mark.provokes("disk_low")
def test_recording_goes_on_in_another_file_and_the_run_says_so(tmp_path):
    words = ["run", str(RIG), "--headless", "--duration", "14", "--record", str(tmp_path / "run.mcap")]
    done = subprocess.run(
        [sys.executable, "-c", WITH_A_LIMIT, *words],
        capture_output=True, text=True, check=False, timeout=120, cwd=ROOT, env=os.environ,
    )  # fmt: skip
    assert done.returncode == 1, done.stdout + done.stderr
    (line,) = done.stderr.splitlines()
    assert re.match(r"groundstation: \S+run(_\d+)?\.mcap\.part cannot be written any further: File too", line)
    assert "Traceback" not in done.stdout
    assert "FAULT disk_low" in done.stdout
    assert "it is full: nothing is recorded" in done.stdout
    assert f"recording goes on in {tmp_path / 'run_1.mcap'}" in done.stdout
    left = sorted(tmp_path.iterdir())
    assert all(path.name.startswith("run") for path in left)
    assert len(left) >= 2
    stamps = []
    for path in left:
        assert path.stat().st_size <= LIMIT
        if path.suffix == PART_SUFFIX:  # as large as a file may be, its index found no room in it
            whole = tmp_path / "saved" / path.stem
            whole.parent.mkdir(exist_ok=True)
            recover(path, whole)
            path = whole
        with Recording(path) as recording:
            stamps += [state.payload.stamp_ns for state in recording.delivered([VehicleState])]
    assert len(stamps) == len(set(stamps)) > 300
