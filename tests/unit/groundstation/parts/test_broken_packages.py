"""A package whose part cannot be used is named in one sentence, whatever its import does."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoint

import pytest

from groundstation.declarations.errors import UsageError
from groundstation.parts import table


@pytest.mark.parametrize(
    ("source", "why"),
    [
        ("raise RuntimeError('no licence')", "cannot be loaded: RuntimeError: no licence"),
        ("import sys; sys.exit(3)", "cannot be loaded: SystemExit: 3"),
        ("", "cannot be loaded: AttributeError: module 'broken_part' has no attribute 'PART'"),
        ("PART = 5", "is a int, expected a Part"),
    ],
)
def test_a_part_that_cannot_be_used_is_named(source, why, tmp_path, monkeypatch):
    (tmp_path / "broken_part.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "broken_part", raising=False)
    point = EntryPoint("broken", "broken_part:PART", table.ENTRY_POINT_GROUP)
    monkeypatch.setattr(table, "entry_points", lambda group: [point])
    with pytest.raises(UsageError) as refusal:
        table.installed_tables.__wrapped__()
    assert str(refusal.value) == f"the part 'broken' of the package broken_part (broken_part:PART) {why}"


@pytest.mark.parametrize("action", ["stop", "land"])
def test_a_stop_can_be_requested_whatever_else_is_installed(tmp_path, action):
    """In a process of its own: a package that is broken, installed as pip would."""
    (tmp_path / "broken_part.py").write_text("raise RuntimeError('no licence')")
    info = tmp_path / "broken-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1\n")
    (info / "entry_points.txt").write_text(f"[{table.ENTRY_POINT_GROUP}]\nbroken = broken_part:PART\n")
    environment = os.environ | {"PYTHONPATH": str(tmp_path), "XDG_RUNTIME_DIR": str(tmp_path)}
    command = [sys.executable, "-m", "groundstation", "request", "alpha", action]
    asked = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    is_loaded = action != "stop"  # a stop waits for no package
    assert ("'broken' of the package broken" in asked.stderr) is is_loaded
    assert ("its actions are left out" in asked.stderr) is is_loaded
    assert "no rig is running" in asked.stderr, "it came as far as looking for the run"
