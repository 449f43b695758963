"""A run as quantities see it, and the value that they give. Pure."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from groundstation.parts.scenario.conditions import Bounds
from groundstation.scenario.flight_log import Array, VehicleTrack
from groundstation.watch.verdict import RunEvent


@dataclass(frozen=True, slots=True)
class Keeps:
    """What a follower is to keep.

    Attributes:
        leader: Of whom.
        distance_m: Between the origins of the bodies.
        faces: Whether body +x is to point at the leader.
    """

    leader: str
    distance_m: float
    faces: bool


@dataclass(frozen=True, slots=True)
class Docks:
    """Whom a vehicle docks with.

    Attributes:
        target: Of whom.
        axis_rad: Of the port in the target's body.
        contact_m: Between the origins of the bodies at contact.
    """

    target: str
    axis_rad: float
    contact_m: float


@dataclass(frozen=True, slots=True, eq=False)
class RunTracks:
    """A run as quantities see it.

    Attributes:
        tracks: By vehicle.
        events: What happened.
        bounds: Of the table.
        obstacles: x, y, radius (m) of each.
        thrust_n: Nominal thrust of a valve, by vehicle.
        keeps: What followers are to keep, by vehicle.
        docks: Whom vehicles dock with, by vehicle.
        duration_s: From t = 0 to the end.
    """

    tracks: Mapping[str, VehicleTrack]
    events: tuple[RunEvent, ...]
    bounds: Bounds
    obstacles: tuple[tuple[float, float, float], ...]
    thrust_n: Mapping[str, float]
    keeps: Mapping[str, Keeps]
    duration_s: float
    docks: Mapping[str, Docks] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Span:
    """Of a limit, s from t = 0."""

    from_s: float
    to_s: float


@dataclass(frozen=True, slots=True)
class Value:
    """A quantity's value, and when it was reached (s from t = 0)."""

    value: float
    at_s: float


UNKNOWN = Value(math.nan, math.nan)


def largest(times: Array, values: Array) -> Value:
    """The largest value, and when it was reached first."""
    if not len(values) or not np.isfinite(values).any():
        return UNKNOWN
    place = int(np.nanargmax(values))
    return Value(float(values[place]), float(times[place]))


def least(times: Array, values: Array) -> Value:
    """The least value, and when it was reached first."""
    found = largest(times, -values)
    return Value(-found.value, found.at_s)


def rms(values: Array, span: Span) -> Value:
    """Root of the mean square over a span; reached at its end."""
    return Value(math.sqrt(float(np.mean(values**2))), span.to_s) if len(values) else UNKNOWN
