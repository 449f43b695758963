"""How near a vehicle came to edge, obstacles and others; what a follower kept. Pure."""

import math

import numpy as np

from groundstation.declarations.rig import MOCK_UP_RADIUS_M
from groundstation.scenario.flight_log import Array, within
from groundstation.scenario.run_tracks import UNKNOWN, RunTracks, Span, Value, least, rms


def least_edge_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """From the hull to the nearest edge."""
    rows = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)
    return least(rows[:, 0], 1e3 * _edge_m(flown, rows))


def least_obstacle_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """From the hull to the nearest obstacle."""
    rows = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)
    return least(rows[:, 0], 1e3 * _obstacle_m(flown, rows)) if flown.obstacles else UNKNOWN


def least_distance_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """Between two hulls."""
    rows = _apart(flown, vehicles, span)
    return least(rows[:, 0], 1e3 * _hulls_m(rows))


def contacts(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """How often a hull came to touch an edge, an obstacle or another hull."""
    name = vehicles[0]
    rows = within(flown.tracks[name].truth, span.from_s, span.to_s)
    if not len(rows):
        return UNKNOWN
    gaps_m = [_hulls_m(_apart(flown, (name, other), span)) for other in flown.tracks if other != name]
    gaps_m.append(_edge_m(flown, rows))
    if flown.obstacles:
        gaps_m.append(_obstacle_m(flown, rows))
    begun = [np.flatnonzero(np.diff(gap_m <= 0.0, prepend=False) & (gap_m <= 0.0)) for gap_m in gaps_m]
    first_s = min([float(rows[places[0], 0]) for places in begun if len(places)], default=span.to_s)
    return Value(float(sum(map(len, begun))), first_s)


def distance_error_rms_mm(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """A follower's distance to its leader, less the one to be kept."""
    keeps = flown.keeps.get(vehicles[0])
    if keeps is None:
        return UNKNOWN
    rows = _apart(flown, (vehicles[0], keeps.leader), span)
    return rms(1e3 * (rows[:, 1] - keeps.distance_m), span)


def pointing_error_rms_deg(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """A follower's heading, less the direction to its leader."""
    keeps = flown.keeps.get(vehicles[0])
    if keeps is None:
        return UNKNOWN
    rows = _apart(flown, (vehicles[0], keeps.leader), span)
    heading_rad = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)[:, 3]
    if not len(rows):
        return UNKNOWN
    off_rad = (heading_rad - np.arctan2(rows[:, 3], rows[:, 2]) + math.pi) % math.tau - math.pi
    return rms(np.degrees(off_rad), span)


def _edge_m(flown: RunTracks, rows: Array) -> Array:
    """From the hull to the nearest edge; negative beyond it."""
    (x_low, x_high), (y_low, y_high) = flown.bounds.x_m, flown.bounds.y_m
    x, y = rows[:, 1], rows[:, 2]
    room: Array = np.minimum.reduce([x - x_low, x_high - x, y - y_low, y_high - y]) - MOCK_UP_RADIUS_M
    return room


def _obstacle_m(flown: RunTracks, rows: Array) -> Array:
    """From the hull to the nearest obstacle; negative inside it."""
    apart = [np.hypot(rows[:, 1] - x, rows[:, 2] - y) - radius for x, y, radius in flown.obstacles]
    room: Array = np.minimum.reduce(apart) - MOCK_UP_RADIUS_M
    return room


def _hulls_m(apart: Array) -> Array:
    """Between two hulls, from the rows of ``_apart``."""
    return apart[:, 1] - 2 * MOCK_UP_RADIUS_M


def _apart(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Array:
    """Rows of t, distance between the origins (m), and the way from the first to the second (m)."""
    first = within(flown.tracks[vehicles[0]].truth, span.from_s, span.to_s)
    second = flown.tracks[vehicles[1]].truth
    if len(second) < 1 or not len(first):
        return np.empty((0, 4))
    way = np.column_stack([np.interp(first[:, 0], second[:, 0], second[:, i]) - first[:, i] for i in (1, 2)])
    return np.column_stack([first[:, 0], np.hypot(*way.T), way])
