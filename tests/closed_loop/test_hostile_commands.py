"""No command sequence, however hostile, takes a mock-up off the table or into another."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[2] / "tools" / "hostile_commands.py"


@pytest.mark.timeout(1200)  # twenty minutes of two mock-ups
@pytest.mark.slow
def test_twenty_hostile_sequences_take_nobody_off_the_table_or_into_another(tmp_path):
    out = tmp_path / "sequences.jsonl"
    words = [sys.executable, str(TOOL), "--seeds", "20", "--out", str(out)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    rows = [json.loads(line) for line in out.read_text().splitlines()]
    assert len(rows) == 20
    assert sum(row["limited"] for row in rows) > 0.05 * sum(row["demands"] for row in rows)  # it was hostile
    assert min(row["demands"] for row in rows) > 100  # and they flew
