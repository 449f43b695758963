"""Closed curves over the table by the length of the way: a perimeter with rounded corners, a figure eight."""

import math
from typing import NamedTuple, Protocol

import numpy as np

from groundstation.control.state import Vector2

_SAMPLES = 4096  # of a round: lengths are then good to a micrometre


class CurvePoint(NamedTuple):
    """Place on a curve (table, m), direction of travel (rad), and curvature (1/m, left positive)."""

    position_table_m: Vector2
    direction_rad: float
    curvature_per_m: float


class Curve(Protocol):
    """A closed curve."""

    length_m: float

    def at(self, way_m: float) -> CurvePoint:
        """Where one is after a way from its beginning, any number of rounds."""


class Perimeter:
    """A rectangle with rounded corners, counter-clockwise from the middle of its lower side.

    Args:
        centre_m: Table x, y.
        size_m: Along table x and y.
        corner_radius_m: At most half the shorter side.
    """

    def __init__(self, centre_m: Vector2, size_m: Vector2, corner_radius_m: float) -> None:
        half_x, half_y = (0.5 * size - corner_radius_m for size in size_m)
        arc_m = 0.5 * math.pi * corner_radius_m
        bend = 1.0 / corner_radius_m
        self._legs = tuple(
            (length_m, curvature)
            for length_m, curvature in (
                (half_x, 0.0),
                *((arc_m, bend), (2.0 * half_y, 0.0), (arc_m, bend), (2.0 * half_x, 0.0)),
                *((arc_m, bend), (2.0 * half_y, 0.0), (arc_m, bend), (half_x, 0.0)),
            )
        )
        self.length_m = math.fsum(length_m for length_m, _ in self._legs)
        self._start = (centre_m[0], centre_m[1] - half_y - corner_radius_m)

    def at(self, way_m: float) -> CurvePoint:
        """See `Curve.at`."""
        left_m, (x, y), direction_rad = way_m % self.length_m, self._start, 0.0
        for length_m, curvature in self._legs:
            part_m = min(left_m, length_m)
            turn_rad = curvature * part_m
            # a circle's chord at the mean of its directions; on a straight leg the way itself
            chord_m = part_m if turn_rad == 0.0 else 2.0 / curvature * math.sin(0.5 * turn_rad)
            x += chord_m * math.cos(direction_rad + 0.5 * turn_rad)
            y += chord_m * math.sin(direction_rad + 0.5 * turn_rad)
            direction_rad += turn_rad
            if left_m <= length_m:
                return CurvePoint((x, y), direction_rad, curvature)
            left_m -= length_m
        return CurvePoint((x, y), direction_rad, 0.0)


class FigureEight:
    """The lemniscate of Gerono, x = a cos u, y = b sin 2u: two loops along table x that cross in the centre.

    Args:
        centre_m: Table x, y of the crossing.
        size_m: Along table x and y: 2 a and 2 b.
    """

    def __init__(self, centre_m: Vector2, size_m: Vector2) -> None:
        self._centre, self._a, self._b = centre_m, 0.5 * size_m[0], 0.5 * size_m[1]
        self._u = np.linspace(0.0, math.tau, _SAMPLES + 1)
        speeds = np.hypot(self._a * np.sin(self._u), 2.0 * self._b * np.cos(2.0 * self._u))
        # by the trapezoidal rule, exact beyond all powers over a period
        steps = 0.5 * (speeds[1:] + speeds[:-1]) * (math.tau / _SAMPLES)
        self._ways = np.concatenate([[0.0], np.cumsum(steps)])
        self.length_m = float(self._ways[-1])

    def at(self, way_m: float) -> CurvePoint:
        """See `Curve.at`."""
        u = float(np.interp(way_m % self.length_m, self._ways, self._u))
        x = self._centre[0] + self._a * math.cos(u)
        y = self._centre[1] + self._b * math.sin(2.0 * u)
        along = (-self._a * math.sin(u), 2.0 * self._b * math.cos(2.0 * u))
        bend = (-self._a * math.cos(u), -4.0 * self._b * math.sin(2.0 * u))
        curvature = (along[0] * bend[1] - along[1] * bend[0]) / math.hypot(*along) ** 3
        return CurvePoint((x, y), math.atan2(along[1], along[0]), curvature)


def tightest_per_m(curve: Curve) -> float:
    """Largest curvature of a curve."""
    return max(abs(point.curvature_per_m) for point in sampled(curve))


def sampled(curve: Curve) -> list[CurvePoint]:
    """Points all along a curve."""
    return [curve.at(curve.length_m * number / _SAMPLES * 8) for number in range(_SAMPLES // 8)]
