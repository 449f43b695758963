"""What stands in which columns of two-line elements, and what it can be: refused by column and field."""

from __future__ import annotations

import calendar
import math
import re
from typing import NamedTuple

EARTH_GM_M3_S2 = 3.986008e14
"""WGS 72, the constants of SGP4."""
EARTH_RADIUS_M = 6378135.0
"""Of the equator in WGS 72."""
MOST_REVOLUTIONS = 17.2
"""A day: with more an object is below the ground."""
LEAST_REVOLUTIONS = 0.03
"""A day: with fewer it is farther than the Moon."""
_DAY_S = 86400.0


class Field(NamedTuple):
    """A field of a line.

    Attributes:
        name: For people.
        first: Column, from 1.
        last: Column.
        form: What it holds.
        example: How it looks.
    """

    name: str
    first: int
    last: int
    form: str
    example: str

    def of(self, line: str) -> str:
        """What a line has there."""
        return line[self.first - 1 : self.last]

    @property
    def where(self) -> str:
        """Its columns, in words."""
        return f"columns {self.first} to {self.last}" if self.last > self.first else f"column {self.first}"


_NUMBER = Field("the catalogue number", 3, 7, r"[ \dA-Z]\d{4}", "25063")
_YEAR = Field("the year of the epoch", 19, 20, r"[ \d]\d", "01")
_DAY = Field("the day of the epoch", 21, 32, r"[ \d]{2}\d\.\d{8}", "065.47684936")
_INCLINATION = Field("the inclination", 9, 16, r"[ \d]{2}\d\.\d{4}", " 34.9848")
_NODE = Field("the ascending node", 18, 25, r"[ \d]{2}\d\.\d{4}", "213.3710")
_ECCENTRICITY = Field("the eccentricity", 27, 33, r"\d{7}", "0001408")
_PERIGEE = Field("the argument of the perigee", 35, 42, r"[ \d]{2}\d\.\d{4}", "234.2325")
_ANOMALY = Field("the mean anomaly", 44, 51, r"[ \d]{2}\d\.\d{4}", "124.0029")
_MOTION = Field("the mean motion", 53, 63, r"[ \d]\d\.\d{8}", "15.74091534")
_SMALL = r"[-+ ][\d ]\d{4}[-+ ]\d"
FIELDS = (
    (
        Field("the number of the line", 1, 1, "1", "1"),
        _NUMBER,
        Field("the classification", 8, 8, "[A-Z ]", "U"),
        Field("the launch", 10, 17, r"[\dA-Z ]{8}", "97074A  "),
        _YEAR,
        _DAY,
        Field("half the first derivative of the mean motion", 34, 43, r"[-+ ]\.\d{8}", " .00084763"),
        Field("a sixth of the second derivative of the mean motion", 45, 52, _SMALL, " 00000-0"),
        Field("the drag term", 54, 61, _SMALL, " 56564-3"),
        Field("the kind of the ephemeris", 63, 63, r"[\d ]", "0"),
        Field("the number of the set", 65, 68, r"[ \d]{4}", " 984"),
        Field("the checksum", 69, 69, r"\d", "3"),
    ),
    (
        Field("the number of the line", 1, 1, "2", "2"),
        _NUMBER,
        _INCLINATION,
        _NODE,
        _ECCENTRICITY,
        _PERIGEE,
        _ANOMALY,
        _MOTION,
        Field("the revolution", 64, 68, r"[ \d]{5}", "18836"),
        Field("the checksum", 69, 69, r"\d", "8"),
    ),
)
"""Line 1 and line 2; between fields stand spaces."""


def check_columns(line: str, kind: int) -> None:
    """Refuse a line, 69 characters, whose columns are not those of line ``kind``, or mean nothing.

    Raises:
        ValueError: The message names columns and field.
    """
    at = 1
    for field in FIELDS[kind - 1]:
        for column in range(at, field.first):
            if line[column - 1] != " ":
                raise ValueError(f"column {column} holds {line[column - 1]!r}, expected a space")
        if not re.fullmatch(field.form, field.of(line), re.ASCII):
            raise ValueError(
                f"{field.where} hold{'s' if field.first == field.last else ''} {field.of(line)!r}, expected "
                f"{field.name}, such as {field.example!r}"
            )
        at = field.last + 1
    (_check_epoch, _check_orbit)[kind - 1](line)


def _check_epoch(line: str) -> None:
    year = int(_YEAR.of(line))
    year += 1900 if year >= 57 else 2000
    day = float(_DAY.of(line))
    if not 1.0 <= day < 366.0 + calendar.isleap(year):
        raise ValueError(f"day {day:g} ({_DAY.where}) is none of a year, here {year}")


def _check_orbit(line: str) -> None:
    for field, most in ((_INCLINATION, 180.0), (_NODE, 360.0), (_PERIGEE, 360.0), (_ANOMALY, 360.0)):
        if float(field.of(line)) > most:
            raise ValueError(
                f"{field.name} ({field.where}) is {float(field.of(line)):g} degrees, expected 0 to {most:g}"
            )
    motion = float(_MOTION.of(line))
    if not LEAST_REVOLUTIONS <= motion <= MOST_REVOLUTIONS:
        raise ValueError(
            f"{_MOTION.name} ({_MOTION.where}) is {motion:g} revolutions a day, expected "
            f"{LEAST_REVOLUTIONS:g} to {MOST_REVOLUTIONS:g}: with more an object is below the ground"
        )
    rate = motion * math.tau / _DAY_S
    eccentricity = float(f"0.{_ECCENTRICITY.of(line)}")
    perigee = (EARTH_GM_M3_S2 / rate**2) ** (1.0 / 3.0) * (1.0 - eccentricity)
    if perigee < 0.99 * EARTH_RADIUS_M:
        raise ValueError(
            f"{_ECCENTRICITY.name} ({_ECCENTRICITY.where}) is {eccentricity:g}: with {motion:g} revolutions "
            f"a day the perigee is {1e-3 * (EARTH_RADIUS_M - perigee):.0f} km below the ground"
        )
