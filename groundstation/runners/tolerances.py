"""What a replay may differ by: data, read from TOML.

One table per topic, ``field = largest absolute difference``; the table ``default`` holds differences by the
last words of a field's name, its unit, for floating-point fields that their topic's table does not name. What
neither names is compared bit for bit, as texts, counts and stamps always are::

    [default]
    m = 1e-9          # position_table_m, x_m
    other = 1e-9      # fields whose name ends in none of these words

    [wrench]
    force_x_n = 1e-6
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from groundstation.bus.cdr import ros_fields
from groundstation.declarations.errors import UsageError
from groundstation.declarations.message import Message
from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes
from groundstation.files.toml_file import parse_toml

DEFAULT = "default"
OTHER = "other"


@dataclass(frozen=True, slots=True)
class Tolerances:
    """Largest absolute differences, in the fields' units.

    Attributes:
        by_field: Noun of a topic to field to difference.
        by_unit: Ending of a field's name to difference, or ``other``; the longest ending that fits counts.
    """

    by_field: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    by_unit: Mapping[str, float] = field(default_factory=dict)

    def allowed(self, noun: str, name: str) -> float | None:
        """By how much a floating-point field of a topic may differ; None where every bit counts."""
        own = self.by_field.get(noun, {}).get(name)
        if own is not None:
            return own
        fitting = [unit for unit in self.by_unit if _ends_in(name, unit)]
        return self.by_unit.get(max(fitting, key=len, default=OTHER))


EXACT = Tolerances()


def load_tolerances(path: Path, payloads: Mapping[str, type[Message]]) -> Tolerances:
    """Read tolerances.

    Args:
        path: Of the file.
        payloads: Payload classes by noun.

    Raises:
        UsageError: The file cannot be read, or names a topic or field that does not exist.
    """
    try:
        tables = parse_toml(read_bytes(path), path)
    except FileError as error:
        raise UsageError(str(error)) from error
    for noun, table in tables.items():
        if noun != DEFAULT and noun not in payloads:
            raise UsageError(f"{path}: {noun!r} is no topic")
        if not isinstance(table, dict):
            raise UsageError(f"{path}: {noun}: expected a table of fields, found {table!r}")
        named = payloads.values() if noun == DEFAULT else [payloads[noun]]
        known = {name for kind in named for name, ros in ros_fields(kind) if ros.startswith("float")}
        for name, value in table.items():
            fits = any(_ends_in(one, name) for one in known) if noun == DEFAULT else name in known
            if not fits and (noun, name) != (DEFAULT, OTHER):
                raise UsageError(f"{path}: {noun}.{name} is no field of floating-point numbers")
            if not _is_distance(value):
                raise UsageError(f"{path}: {noun}.{name}: expected a number from 0 up, found {value!r}")
    by_unit = tables.pop(DEFAULT, {})
    return Tolerances(tables, by_unit)


def _ends_in(name: str, unit: str) -> bool:
    return name == unit or name.endswith(f"_{unit}")


def _is_distance(value: object) -> bool:
    return not isinstance(value, bool) and isinstance(value, int | float) and 0 <= value < math.inf
