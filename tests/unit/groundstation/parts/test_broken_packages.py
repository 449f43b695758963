"""A package whose part cannot be used is named in one sentence, whatever its import does."""

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
