"""The first contact of a docking: how fast, and how far beside the port. Pure.

By truth, from the last sample before the hulls touch: a reference system that samples cannot see the moment
itself, and a bumper changes the velocity within a hundredth of a second.
"""

import math

import numpy as np

from groundstation.scenario.flight_log import Array, within
from groundstation.scenario.run_tracks import UNKNOWN, RunTracks, Span, Value

_TOUCHING_M = 5e-4
"""Nearer than this they touch, or do within the next sample: 20 a second at 1 cm/s."""


def contact_speed_mm_s(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """At which the hulls of a pair close in; infinite where they never touch."""
    return _at_contact(flown, vehicles, span, 0)


def contact_lateral_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """From the axis of the target's port to the ship's centre; infinite where they never touch."""
    return _at_contact(flown, vehicles, span, 1)


def _at_contact(flown: RunTracks, vehicles: tuple[str, ...], span: Span, column: int) -> Value:
    docks = flown.docks.get(vehicles[0])
    if docks is None or docks.target not in flown.tracks:
        return UNKNOWN
    ship = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)
    target = flown.tracks[docks.target].truth
    if len(ship) < 2 or len(target) < 2:
        return UNKNOWN
    beside = np.column_stack([np.interp(ship[:, 0], target[:, 0], target[:, i]) for i in range(1, 6)])
    way, moving = ship[:, 1:3] - beside[:, 0:2], ship[:, 4:6] - beside[:, 3:5]
    apart_m = np.hypot(*way.T)
    touching = np.flatnonzero(apart_m <= docks.contact_m + _TOUCHING_M)
    if not len(touching):
        return Value(math.inf, span.to_s)
    before = max(int(touching[0]) - 1, 0)
    found: Array = np.array([
        -(way[before] @ moving[before]) / apart_m[before],
        abs(_across(way[before], beside[before, 2] + docks.axis_rad)),
    ])  # fmt: skip
    return Value(1e3 * float(found[column]), float(ship[touching[0], 0]))


def _across(way_m: Array, axis_rad: float) -> float:
    return float(way_m[1] * math.cos(axis_rad) - way_m[0] * math.sin(axis_rad))
