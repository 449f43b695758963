"""Which coloured circles each mock-up wears, read from a TOML file; seen by the camera over the table.

One table per mock-up: ``height_m`` of the circles above the table, their ``radius_m``, and three
``circles``, each with ``colour``, ``x_m`` and ``y_m`` of its centre in the body frame.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from groundstation.files.reading import read_bytes
from groundstation.files.toml_file import made_of_tables
from groundstation.files.values import check_keys, number

COLOURS = ("red", "green", "blue")
MIN_DIFFERENCE_M = 0.02
"""Patterns are told apart by their sides; those measured may be a centimetre off."""
_CIRCLES = 3
_MIN_AREA_M2 = 1e-3


@dataclass(frozen=True, slots=True)
class Circle:
    """One circle on a mock-up: colour by name, centre in the body frame (m)."""

    colour: str
    x_body_m: float
    y_body_m: float

    def __post_init__(self) -> None:
        if self.colour not in COLOURS:
            raise ValueError(f"colour '{self.colour}' is none of {', '.join(COLOURS)}")
        if not (math.isfinite(self.x_body_m) and math.isfinite(self.y_body_m)):
            raise ValueError("the centre of a circle must be finite")


@dataclass(frozen=True, slots=True)
class Livery:
    """The three circles of one mock-up.

    Attributes:
        vehicle: Its name.
        circles: Three, not on one line and not overlapping.
        height_table_m: Of the circles above the table's surface.
        radius_m: Of each circle.

    Raises:
        ValueError: The circles cannot give a pose; the message gives the reason.
    """

    vehicle: str
    circles: tuple[Circle, Circle, Circle]
    height_table_m: float
    radius_m: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius_m) and self.radius_m > 0.0):
            raise ValueError(f"the circles of '{self.vehicle}' need a radius above 0")
        if not (math.isfinite(self.height_table_m) and self.height_table_m >= 0.0):
            raise ValueError(f"the circles of '{self.vehicle}' need a height of at least 0")
        a, b, c = (complex(circle.x_body_m, circle.y_body_m) for circle in self.circles)
        if abs(((b - a).conjugate() * (c - a)).imag) < _MIN_AREA_M2:
            raise ValueError(f"the circles of '{self.vehicle}' lie on one line, or nearly so")
        if min(abs(b - a), abs(c - b), abs(a - c)) < 2.0 * self.radius_m:
            raise ValueError(f"the circles of '{self.vehicle}' overlap")
        if _look_alike(self, self):
            raise ValueError(f"the circles of '{self.vehicle}' look the same in another turn")


def check_distinct(liveries: Sequence[Livery]) -> None:
    """Refuse mock-ups that cannot be told apart from above.

    Raises:
        ValueError: Two wear the same pattern.
    """
    for first, second in itertools.combinations(liveries, 2):
        if _look_alike(first, second):
            raise ValueError(
                f"'{first.vehicle}' and '{second.vehicle}' look the same from above: "
                f"move a circle by more than {1e3 * MIN_DIFFERENCE_M:g} mm, or swap two colours"
            )


def load_liveries(path: Path | str) -> tuple[Livery, ...]:
    """Read the circles of all mock-ups.

    Raises:
        FileError: The file is missing, no TOML, or a key is missing or impossible.
    """
    return parse_liveries(read_bytes(Path(path)), Path(path))


def parse_liveries(data: bytes, path: Path) -> tuple[Livery, ...]:
    """Read the content of the file of circles.

    Raises:
        FileError: It is no TOML, or a key is missing or impossible.
    """
    return made_of_tables(data, path, _liveries)


def _liveries(tables: Mapping[str, object]) -> tuple[Livery, ...]:
    liveries = tuple(_livery(name, table) for name, table in tables.items())
    check_distinct(liveries)
    return liveries


def _livery(name: str, table: object) -> Livery:
    if not isinstance(table, dict):
        raise ValueError(f"'{name}' must be a table with height_m, radius_m and circles")
    check_keys(table, name, ("height_m", "radius_m", "circles"))
    circles = table.get("circles")
    if not isinstance(circles, list) or len(circles) != _CIRCLES:
        raise ValueError(f"{name}.circles must be a list of three circles")
    made = []
    for i, circle in enumerate(circles):
        where = f"{name}.circles.{i}"
        if not isinstance(circle, dict):
            raise ValueError(f"{where} must be a table with colour, x_m and y_m")
        check_keys(circle, where, ("colour", "x_m", "y_m"))
        try:
            x_m, y_m = (number(circle, key, f"{where}.{key}") for key in ("x_m", "y_m"))
            made.append(Circle(str(circle.get("colour")), x_m, y_m))
        except ValueError as error:
            message = str(error)
            raise ValueError(message if message.startswith(where) else f"{where}: {message}") from error
    height_m, radius_m = (number(table, key, f"{name}.{key}") for key in ("height_m", "radius_m"))
    return Livery(name, (made[0], made[1], made[2]), height_m, radius_m)


def _look_alike(first: Livery, second: Livery) -> bool:
    """Whether a turn and a shift carry one pattern's colours near the other's (on itself: another turn)."""
    places = [[complex(c.x_body_m, c.y_body_m) for c in livery.circles] for livery in (first, second)]
    for order in itertools.permutations(range(_CIRCLES)):
        if first is second and order == (0, 1, 2):
            continue
        if any(first.circles[i].colour != second.circles[j].colour for i, j in enumerate(order)):
            continue
        a, b = places[0], [places[1][j] for j in order]
        # the same signed triangle: two sides and the handedness, in the frame of the first side
        side_a, side_b = a[1] - a[0], b[1] - b[0]
        turn = side_b / side_a / abs(side_b / side_a)
        off = [abs((b[i] - b[0]) - turn * (a[i] - a[0])) for i in (1, 2)]
        if max(off) < MIN_DIFFERENCE_M:
            return True
    return False
