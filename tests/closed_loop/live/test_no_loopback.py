"""A machine whose loopback interface is down: one sentence, at once, and nothing is left behind."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
RIG = ROOT / "examples" / "rigs" / "drawn_fixes.toml"
APART = ["unshare", "--map-root-user", "--net"]


def can_be_apart():
    try:
        return subprocess.run([*APART, "true"], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


@pytest.mark.skipif(not can_be_apart(), reason="no network of its own may be made here")
def test_without_a_loopback_interface_a_run_ends_in_a_sentence(tmp_path):
    words = ["run", str(RIG), "--headless", "--duration", "1", "--record", str(tmp_path / "a.mcap")]
    done = subprocess.run(
        [*APART, sys.executable, "-m", "groundstation", *words],
        capture_output=True, text=True, check=False, timeout=60, cwd=ROOT, env=os.environ,
    )  # fmt: skip
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith("groundstation: this machine does not reach itself at 127.0.0.1 (")
    assert not list(tmp_path.iterdir())
