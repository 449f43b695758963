"""Payloads are made by setters of their own and are still frozen dataclasses."""

from dataclasses import FrozenInstanceError, fields, replace

import pytest

from groundstation.parts.table import installed_tables

KINDS = sorted(installed_tables().payloads.values(), key=lambda kind: kind.__name__)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_a_payload_takes_its_fields_by_place_and_by_name_and_keeps_them(kind):
    values = {row.name: object() for row in fields(kind)}
    for made in (kind(*values.values()), kind(**values), replace(kind(**values))):
        assert {name: getattr(made, name) for name in values} == values
    assert kind.__init__.__annotations__.keys() >= values.keys()
    with pytest.raises(FrozenInstanceError):
        made.stamp_ns = 1
    with pytest.raises(TypeError, match=rf"{kind.__name__}\.__init__\(\) missing"):
        kind(*list(values.values())[:-1])
    with pytest.raises(TypeError, match="unexpected keyword"):
        kind(**values, no_field=1)
