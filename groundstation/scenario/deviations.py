"""How far a vehicle was from where its controller wanted it, and from where it believed to be. Pure."""

import math

import numpy as np

from groundstation.parts.control.gauges import station_errors
from groundstation.parts.reference.gauges import estimate_errors
from groundstation.parts.scenario.conditions import SETTLED_FOR_NS, SETTLED_M, SETTLED_M_S, SETTLED_RAD
from groundstation.scenario.flight_log import Array, within
from groundstation.scenario.run_tracks import UNKNOWN, RunTracks, Span, Value, largest, rms

SETTLED_FOR_S = SETTLED_FOR_NS * 1e-9


def _off_setpoint(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Array:
    """Rows of t, distance (m), turn (rad)."""
    track = flown.tracks[vehicles[0]]
    return station_errors(within(track.truth, span.from_s, span.to_s), track.setpoint, -math.inf)


def position_error_rms_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """To the controller's setpoint."""
    return rms(1e3 * _off_setpoint(flown, vehicles, span)[:, 1], span)


def position_error_max_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """To the controller's setpoint."""
    rows = _off_setpoint(flown, vehicles, span)
    return largest(rows[:, 0], 1e3 * rows[:, 1])


def heading_error_rms_deg(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """To the setpoint's heading."""
    return rms(np.degrees(_off_setpoint(flown, vehicles, span)[:, 2]), span)


def settling_s(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
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


def overshoot_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
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
            found.append(largest(truth[:, 0], 1e3 * np.maximum(beyond, 0.0)))
    return max(found, key=lambda each: -1.0 if math.isnan(each.value) else each.value)


def _estimate_errors_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Array:
    track = flown.tracks[vehicles[0]]
    if not track.has_truth:
        return np.empty((0, 2))
    rows = estimate_errors(within(track.state, span.from_s, span.to_s), track.truth)
    return np.column_stack([rows[:, 0], 1e3 * np.hypot(rows[:, 1], rows[:, 2])])


def estimate_error_rms_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """Of the estimated position, by truth."""
    return rms(_estimate_errors_mm(flown, vehicles, span)[:, 1], span)


def estimate_error_max_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """Of the estimated position, by truth."""
    rows = _estimate_errors_mm(flown, vehicles, span)
    return largest(rows[:, 0], rows[:, 1])
