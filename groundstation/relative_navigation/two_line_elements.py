"""Two objects of the NORAD catalogue beside each other: two-line elements, SGP4, and their difference.

Ivanov, Karpenko, Ovchinnikov 2012, section 1.2: where nothing else is known, relative motion follows from the
published elements of both. They are mean elements of the model SGP4 (deep space from a period of 225 minutes
on), so nothing but that model may carry them on: here the library ``sgp4``, which holds both. Its axes TEME
are those of date; the difference of two places is turned into the ``orbital`` axes of the first object
(x radial up, y along-track, z along the orbit's normal), which turn with it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np
from numpy.typing import NDArray
from sgp4.api import Satrec
from sgp4.conveniences import sat_epoch_datetime
from sgp4.io import compute_checksum

from groundstation.relative_navigation.element_columns import EARTH_RADIUS_M, check_columns
from groundstation.relative_navigation.hill import HillConstants, hill_constants

Floats = NDArray[np.float64]

COLUMNS = 69
ACCURACY = (
    "As commonly stated, two-line elements place an object to about a kilometre at their epoch and some "
    "kilometres worse each day: the difference is no better, and tells nothing of distances below that."
)
"""What a result has to be read with."""
MOST_AGE_DAYS = 30.0
"""Elements that are older at the moment asked for are refused."""
DEEP_SPACE_S = 225.0 * 60.0
_DAY_S = 86400.0
_NEAR_SHARE = 0.05
"""Of the orbit's radius: farther apart, Hill's equations are off by more than some percent."""
_CIRCULAR = 0.1
"""So eccentric an orbit is still near a circular one."""
LIMITS = (
    f"They need distances within {_NEAR_SHARE:.0%} of the orbit's radius, relative velocities within as much "
    f"of the orbital one, and an eccentricity of at most {_CIRCULAR:g}."
)
"""Of the constants, for people."""
_CAME_DOWN = 6
"""Error of the library: the object decayed."""


@dataclass(frozen=True, slots=True, eq=False)
class TwoLineElements:
    """An object of the catalogue.

    Attributes:
        name: The line above the two, or its number.
        lines: As they stand, 69 characters each.
        notes: What was put right, for people.
    """

    name: str
    lines: tuple[str, str]
    notes: tuple[str, ...] = ()

    @property
    def number(self) -> str:
        """Of the catalogue, as the lines have it."""
        return self.lines[0][2:7].strip()

    @property
    def record(self) -> Satrec:
        """What the library carries on."""
        return Satrec.twoline2rv(*self.lines)

    @property
    def epoch(self) -> datetime:
        """Of the elements, UTC."""
        found: datetime = sat_epoch_datetime(self.record)
        return found.astimezone(UTC)

    @property
    def mean_motion_rad_s(self) -> float:
        """As the line has it, revolutions a day turned into rad/s."""
        return float(self.lines[1][52:63]) * math.tau / _DAY_S

    @property
    def eccentricity(self) -> float:
        """Mean, as the line has it."""
        return float(f"0.{self.lines[1][26:33]}")

    @property
    def semi_major_axis_m(self) -> float:
        """Mean, as the model takes it from the mean motion (Brouwer's: the oblate Earth is in it)."""
        return float(self.record.a) * EARTH_RADIUS_M

    @property
    def period_s(self) -> float:
        """Of a revolution."""
        return math.tau / self.mean_motion_rad_s

    @property
    def is_deep_space(self) -> bool:
        """Whether the model of deep space carries it on."""
        return self.period_s >= DEEP_SPACE_S


@dataclass(frozen=True, slots=True, eq=False)
class RelativeState:
    """The second object seen from the first.

    Attributes:
        when: UTC.
        position_m: In orbital axes of the first, (3,).
        velocity_m_s: As seen in these axes, which turn, (3,).
        rate_rad_s: How fast they turn.
        constants: Of Hill's equations that begin there; None where these do not hold: they need an orbit near
            a circular one and distances small beside its radius.
        height_m: Of the first above the equator's radius.
    """

    when: datetime
    position_m: Floats
    velocity_m_s: Floats
    rate_rad_s: float
    constants: HillConstants | None
    height_m: float


def parse_elements(text: str) -> list[TwoLineElements]:
    """Read all objects of a text, each two lines, with or without a line of its name above.

    Raises:
        ValueError: A line is not as it should be; the message names line and reason.
    """
    rows = [(number, line.rstrip()) for number, line in enumerate(text.splitlines(), 1)]
    rows = [(number, line) for number, line in rows if line]
    found: list[TwoLineElements] = []
    name = ""
    at = 0
    while at < len(rows):
        number, line = rows[at]
        if not line.startswith(("1 ", "1*")):
            if line.startswith(("2 ", "2*")) or name:
                raise ValueError(f"line {number}: expected line 1 of an element set, found {line[:24]!r}")
            name, at = line.removeprefix("0 ").strip(), at + 1
            continue
        if at + 1 == len(rows):
            raise ValueError(f"line {number}: line 2 of the element set is missing")
        found.append(_object(name, number, line, *rows[at + 1]))
        name, at = "", at + 2
    if name:
        raise ValueError(f"line {rows[-1][0]}: an element set is missing behind {name!r}")
    return found


def _object(name: str, number: int, first: str, next_number: int, second: str) -> TwoLineElements:
    notes: list[str] = []
    lines = (_checked(first, 1, number, notes), _checked(second, 2, next_number, notes))
    if lines[0][2:7] != lines[1][2:7]:
        raise ValueError(
            f"line {next_number}: catalogue number {lines[1][2:7]!r} is not that of line 1, {lines[0][2:7]!r}"
        )
    record = Satrec.twoline2rv(*lines)
    if record.error:
        raise ValueError(f"line {next_number}: eccentricity, mean motion and drag together are of no orbit")
    return TwoLineElements(name or lines[0][2:7].strip(), lines, tuple(notes))


def _checked(line: str, kind: int, number: int, notes: list[str]) -> str:
    """One line with all its columns in place."""
    if len(line) == COLUMNS + 1 and line.endswith("."):
        line = line[:-1]
        notes.append(f"line {number}: a full stop behind column {COLUMNS} was left out")
    if "*" in line:
        raise ValueError(f"line {number}: column {line.index('*') + 1} holds an asterisk: is it a space?")
    if len(line) != COLUMNS:
        raise ValueError(f"line {number}: {len(line)} characters, expected {COLUMNS}")
    if not line.startswith(f"{kind} "):
        raise ValueError(f"line {number}: expected line {kind} of the element set, found {line[:24]!r}")
    if not line[-1].isdigit() or int(line[-1]) != compute_checksum(line):
        raise ValueError(
            f"line {number}: checksum is {line[-1]}, the line adds up to {compute_checksum(line)}"
        )
    try:
        check_columns(line, kind)
    except ValueError as error:
        raise ValueError(f"line {number}: {error}") from error
    return line


def teme_state(elements: TwoLineElements, when: datetime) -> tuple[Floats, Floats]:
    """Return position (m) and velocity (m/s) in TEME, each (3,).

    Raises:
        ValueError: The elements are too old for that moment, or the model gives up (the object decayed).
    """
    age_s = (when - elements.epoch).total_seconds()
    if abs(age_s) > MOST_AGE_DAYS * _DAY_S:
        raise ValueError(
            f"{elements.name}: {when:%Y-%m-%dT%H:%M:%SZ} is {abs(age_s) / _DAY_S:.0f} days from the epoch of "
            f"its elements, at most {MOST_AGE_DAYS:g} are taken"
        )
    error, position_km, velocity_km_s = elements.record.sgp4_tsince(age_s / 60.0)
    if error or not np.all(np.isfinite((position_km, velocity_km_s))):
        why = "it has come down by then" if error == _CAME_DOWN else "its elements are of no orbit there"
        raise ValueError(f"{elements.name} at {when:%Y-%m-%dT%H:%M:%SZ}: {why}")
    return 1e3 * np.array(position_km), 1e3 * np.array(velocity_km_s)


def relative_state(first: TwoLineElements, second: TwoLineElements, when: datetime) -> RelativeState:
    """Return where the second object is, seen from the first.

    Raises:
        ValueError: As `teme_state`.
    """
    position, velocity = teme_state(first, when)
    other, other_velocity = teme_state(second, when)
    axes, rate = local_axes(position, velocity)
    away = axes @ (other - position)
    spin = np.array((0.0, 0.0, rate))
    speed = axes @ (other_velocity - velocity) - np.cross(spin, away)
    radius = float(np.linalg.norm(position))
    reach_m = _NEAR_SHARE * radius
    is_near = (
        float(np.linalg.norm(away)) <= reach_m
        and float(np.linalg.norm(speed)) <= reach_m * first.mean_motion_rad_s
        and first.eccentricity <= _CIRCULAR
    )
    constants = hill_constants(away, speed, first.mean_motion_rad_s) if is_near else None
    height = radius - EARTH_RADIUS_M
    return RelativeState(when, away, speed, rate, constants, height)


def local_axes(position: Floats, velocity: Floats) -> tuple[Floats, float]:
    """Return the orbital axes of an object as rows (3, 3), and how fast they turn, rad/s."""
    momentum = np.cross(position, velocity)
    up = position / np.linalg.norm(position)
    normal = momentum / np.linalg.norm(momentum)
    rate = float(np.linalg.norm(momentum) / (position @ position))
    return np.stack((up, np.cross(normal, up), normal)), rate


def moments(start: datetime, minutes: tuple[float, float, float]) -> list[datetime]:
    """Return moments from one on: first, last and step in minutes.

    Raises:
        ValueError: The step is not above zero, the last lies before the first, they are too many, or lie
            where no elements are taken.
    """
    first, last, step = minutes
    if not (all(map(math.isfinite, minutes)) and step > 0.0 and last >= first):
        raise ValueError("minutes must be FIRST:LAST:STEP with a step above zero")
    farthest_days = max(abs(first), abs(last)) / 1440.0
    if farthest_days > 2.0 * MOST_AGE_DAYS:
        raise ValueError(
            f"minutes reach {farthest_days:.4g} days away, at most {MOST_AGE_DAYS:g} days from the epoch of "
            "the elements are taken"
        )
    if (last - first) / step > 1e9:
        raise ValueError("minutes ask for over a thousand million moments, at most 1000000 are taken")
    count = math.floor((last - first) / step + 1e-9) + 1
    if count > 1_000_000:
        raise ValueError(f"minutes ask for {count} moments, at most 1000000 are taken")
    try:
        return [start + timedelta(minutes=first + step * k) for k in range(count)]
    except OverflowError as error:
        raise ValueError("minutes reach beyond the calendar") from error
