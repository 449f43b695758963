"""Every table that people write takes numbers for numbers only, and true or false for truth values only."""

import pytest
from pydantic import BaseModel, ValidationError

from drivers.files.plain_model import PlainModel
from firmware_emulator.config import LaboratoryConfig
from groundstation.control.controllers import controllers
from groundstation.declarations.section import Section
from groundstation.parts.table import installed_tables
from groundstation.rig.compose import rig_model
from groundstation.scenario.scenario_file import ScenarioFile


def tables(model: type[BaseModel], seen: set[type[BaseModel]]) -> set[type[BaseModel]]:
    """A table and all that it holds."""
    if model in seen:
        return seen
    seen.add(model)
    waiting = [field.annotation for field in model.model_fields.values()]
    while waiting:
        kind = waiting.pop()
        waiting += getattr(kind, "__args__", ())
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            tables(kind, seen)
    return seen


def every_table() -> list[type[BaseModel]]:
    found: set[type[BaseModel]] = set()
    roots = [rig_model(installed_tables()), LaboratoryConfig, ScenarioFile]
    for root in [*roots, *(row.config for row in controllers().values())]:
        tables(root, found)
    return sorted(found, key=lambda model: model.__qualname__)


@pytest.mark.parametrize("table", every_table(), ids=lambda table: table.__qualname__)
def test_a_table_is_plain(table):
    assert issubclass(table, PlainModel)


class Sample(Section):
    size_m: float = 1.0
    count: int = 1
    is_on: bool = False
    pair: tuple[float, float] = (0.0, 0.0)
    by_name: dict[str, float | None] = {}  # noqa: RUF012 pydantic copies it
    inner: "Sample | None" = None


@pytest.mark.parametrize(
    "given",
    [
        *({"size_m": wrong} for wrong in (True, "1.0", "x", None, [1.0])),
        *({"count": wrong} for wrong in (False, "1", 1.5, None, [1])),
        *({"is_on": wrong} for wrong in (1, 0.0, "yes", "true")),
        {"pair": [True, 0.0]},
        {"pair": "12"},
        {"by_name": {"a": True}},
        {"by_name": {"a": "1"}},
        {"inner": {"size_m": True}},
        {"inner": {"inner": {"count": True}}},
    ],
    ids=str,
)
def test_another_type_is_refused(given):
    with pytest.raises(ValidationError):
        Sample.model_validate(given)


def test_whole_numbers_may_have_a_point_and_numbers_none():
    given = {"size_m": 2, "count": 3.0, "is_on": True, "pair": [1, 2.5], "inner": {"count": 4}}
    found = Sample.model_validate(given)
    assert (found.size_m, found.count, found.is_on, found.pair) == (2.0, 3, True, (1.0, 2.5))
    assert isinstance(found.size_m, float)
    assert isinstance(found.count, int)
    assert found.inner is not None
