"""THE TABLE of quantities: what limits can be set on, and what a campaign has columns for. Pure.

By truth where there is a reference system, by the estimate otherwise. Each gives a value and the moment at
which it was reached; NaN where there is nothing to make it from, infinite where what it counts never came.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.declarations.rig import MOCK_UP_RADIUS_M
from groundstation.parts.control.gauges import station_errors
from groundstation.parts.reference.gauges import estimate_errors
from groundstation.parts.scenario.conditions import (
    SETTLED_FOR_NS,
    SETTLED_M,
    SETTLED_M_S,
    SETTLED_RAD,
    Bounds,
)
from groundstation.scenario.flight_log import Array, VehicleTrack, within
from groundstation.watch.verdict import RunEvent

SETTLED_FOR_S = SETTLED_FOR_NS * 1e-9


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


@dataclass(frozen=True, slots=True, eq=False)
class Flown:
    """A run as quantities see it.

    Attributes:
        tracks: By vehicle.
        events: What happened.
        bounds: Of the table.
        obstacles: x, y, radius (m) of each.
        thrust_n: Nominal thrust of a valve, by vehicle.
        keeps: What followers are to keep, by vehicle.
        duration_s: From t = 0 to the end.
    """

    tracks: Mapping[str, VehicleTrack]
    events: tuple[RunEvent, ...]
    bounds: Bounds
    obstacles: tuple[tuple[float, float, float], ...]
    thrust_n: Mapping[str, float]
    keeps: Mapping[str, Keeps]
    duration_s: float


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


@dataclass(frozen=True, slots=True)
class Quantity:
    """A row of the table.

    Attributes:
        summary: For people.
        of: Computes it for the vehicles over a span.
        is_of_pair: Of two vehicles; otherwise of one.
        applies: Whether a vehicle has it at all: only then it is a column of a campaign.
    """

    summary: str
    of: Callable[[Flown, tuple[str, ...], Span], Value]
    is_of_pair: bool = False
    applies: Callable[[Flown, str], bool] = lambda flown, vehicle: True


def _largest(times: Array, values: Array) -> Value:
    if not len(values) or not np.isfinite(values).any():
        return UNKNOWN
    place = int(np.nanargmax(values))
    return Value(float(values[place]), float(times[place]))


def _least(times: Array, values: Array) -> Value:
    found = _largest(times, -values)
    return Value(-found.value, found.at_s)


def _rms(values: Array, span: Span) -> Value:
    return Value(math.sqrt(float(np.mean(values**2))), span.to_s) if len(values) else UNKNOWN


# -- one vehicle against its setpoint ------------------------------------------------------------------


def _off_setpoint(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Array:
    """Rows of t, distance (m), turn (rad)."""
    track = flown.tracks[vehicles[0]]
    return station_errors(within(track.truth, span.from_s, span.to_s), track.setpoint, -math.inf)


def _position_error_rms_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    return _rms(1e3 * _off_setpoint(flown, vehicles, span)[:, 1], span)


def _position_error_max_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    rows = _off_setpoint(flown, vehicles, span)
    return _largest(rows[:, 0], 1e3 * rows[:, 1])


def _heading_error_rms_deg(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    return _rms(np.degrees(_off_setpoint(flown, vehicles, span)[:, 2]), span)


def _settling_s(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    """From the last goal in the span, or its beginning, to where it has settled and stays so for 3 s."""
    track = flown.tracks[vehicles[0]]
    goals = within(track.goals, span.from_s, span.to_s)
    goals = goals[np.isfinite(goals[:, 1])]
    since_s = float(goals[-1, 0]) if len(goals) else span.from_s
    truth = within(track.truth, since_s, span.to_s)
    rows = station_errors(truth, track.setpoint, -math.inf)
    if not len(rows):
        return UNKNOWN
    if len(goals):  # until the controller has reported it, the goal itself is what counts
        aim = np.column_stack([truth[:, 1] - goals[-1, 1], truth[:, 2] - goals[-1, 2]])
        early = truth[:, 0] < since_s + 1.0
        rows[early, 1] = np.hypot(*aim[early].T)
    is_near = (
        (rows[:, 1] < SETTLED_M)
        & (np.abs(rows[:, 2]) < SETTLED_RAD)
        & (np.hypot(truth[:, 4], truth[:, 5]) < SETTLED_M_S)
    )
    began_s: float | None = None
    for t_s, near in zip(truth[:, 0], is_near, strict=True):
        if not near:
            began_s = None
        elif began_s is None:
            began_s = float(t_s)
        if began_s is not None and t_s - began_s >= SETTLED_FOR_S:
            return Value(began_s - since_s, began_s)
    return Value(math.inf, span.to_s)


def _overshoot_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    """Largest excursion beyond a goal along the way's direction, over the goals of the span."""
    track = flown.tracks[vehicles[0]]
    goals = within(track.goals, span.from_s, span.to_s)
    found = [UNKNOWN]
    for number, goal in enumerate(goals):
        end_s = float(goals[number + 1, 0]) if number + 1 < len(goals) else span.to_s
        truth = within(track.truth, float(goal[0]), end_s)
        if not len(truth) or math.isnan(goal[1]):
            continue
        way = goal[1:3] - truth[0, 1:3]
        length_m = float(np.hypot(*way))
        if length_m > 0.0:
            beyond = (truth[:, 1:3] - goal[1:3]) @ (way / length_m)
            found.append(_largest(truth[:, 0], 1e3 * np.maximum(beyond, 0.0)))
    return max(found, key=lambda each: -1.0 if math.isnan(each.value) else each.value)


def _gas_ns(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    """Open time of all valves times their nominal thrust."""
    rows = within(flown.tracks[vehicles[0]].open_valves, span.from_s, span.to_s)
    return Value(float(rows[:, 1].sum()) * flown.thrust_n[vehicles[0]], span.to_s)


# -- places ---------------------------------------------------------------------------------------------


def _least_edge_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    rows = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)
    (x_low, x_high), (y_low, y_high) = flown.bounds.x_m, flown.bounds.y_m
    room_m = np.minimum.reduce(
        [rows[:, 1] - x_low, x_high - rows[:, 1], rows[:, 2] - y_low, y_high - rows[:, 2]]
    )
    return _least(rows[:, 0], 1e3 * (room_m - MOCK_UP_RADIUS_M))


def _least_obstacle_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    rows = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)
    if not flown.obstacles or not len(rows):
        return UNKNOWN
    apart_m = np.min(
        [np.hypot(rows[:, 1] - x, rows[:, 2] - y) - radius for x, y, radius in flown.obstacles], axis=0
    )
    return _least(rows[:, 0], 1e3 * (apart_m - MOCK_UP_RADIUS_M))


def _apart(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Array:
    """Rows of t, distance between the origins (m), and the way from the first to the second (m)."""
    first = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)
    second = flown.tracks[vehicles[1]].truth
    if len(second) < 1 or not len(first):
        return np.empty((0, 4))
    way = np.column_stack([np.interp(first[:, 0], second[:, 0], second[:, i]) - first[:, i] for i in (1, 2)])
    return np.column_stack([first[:, 0], np.hypot(*way.T), way])


def _least_distance_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    rows = _apart(flown, vehicles, span)
    return _least(rows[:, 0], 1e3 * (rows[:, 1] - 2 * MOCK_UP_RADIUS_M))


def _contacts(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    """How often a hull came to touch an edge, an obstacle or another hull."""
    name = vehicles[0]
    rows = within(flown.tracks[name].truth, span.from_s, span.to_s)
    others = [
        1e-3 * _gaps(flown, (name, other), span) for other in flown.tracks if other != name and len(rows)
    ]
    edges = [_room(flown, rows)] if len(rows) else []
    count, first_s = 0, span.to_s
    for gap_m in (*others, *edges):
        touches = np.flatnonzero(np.diff(np.concatenate([[False], gap_m <= 0.0]).astype(int)) == 1)
        if len(touches):
            count += len(touches)
            first_s = min(first_s, float(rows[touches[0], 0]))
    return Value(float(count), first_s) if len(rows) else UNKNOWN


def _gaps(flown: Flown, pair: tuple[str, ...], span: Span) -> Array:
    rows = _apart(flown, pair, span)
    gaps: Array = 1e3 * (rows[:, 1] - 2 * MOCK_UP_RADIUS_M)
    return gaps


def _room(flown: Flown, rows: Array) -> Array:
    """From the hull to the nearest edge or obstacle, m."""
    (x_low, x_high), (y_low, y_high) = flown.bounds.x_m, flown.bounds.y_m
    rooms = [rows[:, 1] - x_low, x_high - rows[:, 1], rows[:, 2] - y_low, y_high - rows[:, 2]]
    rooms += [np.hypot(rows[:, 1] - x, rows[:, 2] - y) - radius for x, y, radius in flown.obstacles]
    room: Array = np.min(rooms, axis=0) - MOCK_UP_RADIUS_M
    return room


# -- estimate, followers, faults -------------------------------------------------------------------------


def _estimate_errors_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Array:
    track = flown.tracks[vehicles[0]]
    if not track.has_truth:
        return np.empty((0, 2))
    rows = estimate_errors(within(track.state, span.from_s, span.to_s), track.truth)
    return np.column_stack([rows[:, 0], 1e3 * np.hypot(rows[:, 1], rows[:, 2])])


def _estimate_error_rms_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    return _rms(_estimate_errors_mm(flown, vehicles, span)[:, 1], span)


def _estimate_error_max_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    rows = _estimate_errors_mm(flown, vehicles, span)
    return _largest(rows[:, 0], rows[:, 1])


def _distance_error_rms_mm(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    keeps = flown.keeps.get(vehicles[0])
    if keeps is None:
        return UNKNOWN
    rows = _apart(flown, (vehicles[0], keeps.leader), span)
    return _rms(1e3 * (rows[:, 1] - keeps.distance_m), span)


def _pointing_error_rms_deg(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    keeps = flown.keeps.get(vehicles[0])
    if keeps is None:
        return UNKNOWN
    rows = _apart(flown, (vehicles[0], keeps.leader), span)
    heading_rad = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)[:, 3]
    if not len(rows):
        return UNKNOWN
    off_rad = (heading_rad - np.arctan2(rows[:, 3], rows[:, 2]) + math.pi) % math.tau - math.pi
    return _rms(np.degrees(off_rad), span)


def _follows(flown: Flown, vehicle: str) -> bool:
    return vehicle in flown.keeps


def _faces(flown: Flown, vehicle: str) -> bool:
    return vehicle in flown.keeps and flown.keeps[vehicle].faces


def _faults(flown: Flown, vehicles: tuple[str, ...], span: Span) -> Value:
    """Faults that were found in the span."""
    found = [
        event.t_s
        for event in flown.events
        if event.kind == "fault" and event.vehicle == vehicles[0] and not event.text.endswith(" ends")
        if span.from_s <= event.t_s <= span.to_s
    ]
    return Value(float(len(found)), found[0] if found else span.to_s)


QUANTITIES: Mapping[str, Quantity] = {
    "position_error_rms_mm": Quantity("to the controller's setpoint", _position_error_rms_mm),
    "position_error_max_mm": Quantity("to the controller's setpoint", _position_error_max_mm),
    "heading_error_rms_deg": Quantity("to the controller's setpoint", _heading_error_rms_deg),
    "distance_error_rms_mm": Quantity("a follower's distance", _distance_error_rms_mm, applies=_follows),
    "pointing_error_rms_deg": Quantity("a follower's facing", _pointing_error_rms_deg, applies=_faces),
    "settling_s": Quantity("from the last goal until it has settled", _settling_s),
    "overshoot_mm": Quantity("beyond the goal along the way", _overshoot_mm),
    "gas_ns": Quantity("impulse of all valves, newton-seconds", _gas_ns),
    "least_edge_mm": Quantity("from the hull to the table's edge", _least_edge_mm),
    "least_obstacle_mm": Quantity(
        "from the hull to an obstacle", _least_obstacle_mm, applies=lambda flown, _: bool(flown.obstacles)
    ),
    "least_distance_mm": Quantity("between two hulls", _least_distance_mm, is_of_pair=True),
    "contacts": Quantity("a hull touches an edge, an obstacle or another hull", _contacts),
    "estimate_error_rms_mm": Quantity("of the position, by truth", _estimate_error_rms_mm),
    "estimate_error_max_mm": Quantity("of the position, by truth", _estimate_error_max_mm),
    "faults": Quantity("faults found", _faults),
}
"""THE TABLE."""


def every_quantity(flown: Flown) -> Iterator[tuple[str, Value]]:
    """Each quantity over the whole run, by its column: ``alpha.gas_ns``, ``alpha-beta.least_distance_mm``."""
    whole = Span(0.0, flown.duration_s)
    for vehicle in flown.tracks:
        for name, row in QUANTITIES.items():
            if not row.is_of_pair and row.applies(flown, vehicle):
                yield f"{vehicle}.{name}", row.of(flown, (vehicle,), whole)
    for pair in itertools.combinations(flown.tracks, 2):
        for name, row in QUANTITIES.items():
            if row.is_of_pair:
                yield f"{pair[0]}-{pair[1]}.{name}", row.of(flown, pair, whole)
