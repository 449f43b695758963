"""Whether ways of several ships are safe at every moment: looked at densely, whoever made them."""

import itertools
from typing import NamedTuple

import numpy as np

from groundstation.control.spline import Array
from groundstation.control.trajectories import Margins, Plan, Reconfiguration

_STEP_S = 0.05  # at 0.2 m/s of two ships: a centimetre
_ROUNDING_M = 1e-6


class Room(NamedTuple):
    """What is left at each moment.

    Attributes:
        gap_m: Between two hulls, or a hull and an obstacle, or to the edge of the keep-in region.
        stopping_m: The same, after both have braked from that moment on; infinite for those who part.
        who: For people.
    """

    gap_m: Array
    stopping_m: Array
    who: str


def stopping_m(along_m_s: Array, velocity_m_s: Array, margins: Margins) -> Array:
    """Way to rest along a direction, where braking acts along the velocity; 0 for who flies the other way.

    Args:
        along_m_s: Component of the velocity along the direction, shape (n,).
        velocity_m_s: Shape (n, 2).
        margins: Reaction and braking.
    """
    whole_m_s = np.hypot(velocity_m_s[..., 0], velocity_m_s[..., 1])
    way: Array = np.maximum(along_m_s, 0.0) * (margins.reaction_s + whole_m_s / (2.0 * margins.braking_m_s2))
    return way


def rooms(asked: Reconfiguration, positions_m: Array, velocities_m_s: Array) -> list[Room]:
    """Room between all pairs, to all obstacles and to all edges.

    Args:
        asked: What is kept to.
        positions_m: Shape (n, ships, 2).
        velocities_m_s: Likewise.
    """
    margins, found = asked.margins, []
    for one, other in itertools.combinations(range(len(asked.starts_m)), 2):
        way = positions_m[:, one] - positions_m[:, other]
        apart_m = np.hypot(way[:, 0], way[:, 1])
        unit = way / np.maximum(apart_m, _ROUNDING_M)[:, None]
        v_one, v_other = velocities_m_s[:, one], velocities_m_s[:, other]
        towards, theirs = -(v_one * unit).sum(axis=1), (v_other * unit).sum(axis=1)
        needs = stopping_m(towards, v_one, margins) + stopping_m(theirs, v_other, margins)
        gap_m = apart_m - 2.0 * margins.radius_m
        found.append(
            Room(gap_m, np.where(towards + theirs > 0.0, gap_m - needs, np.inf), f"ships {one} and {other}")
        )
    for ship in range(len(asked.starts_m)):
        at, velocity = positions_m[:, ship], velocities_m_s[:, ship]
        for x, y, radius in asked.obstacles_m:
            way = at - (x, y)
            apart_m = np.hypot(way[:, 0], way[:, 1])
            towards = -(velocity * way).sum(axis=1) / np.maximum(apart_m, _ROUNDING_M)
            gap_m = apart_m - radius - margins.radius_m
            needs = stopping_m(towards, velocity, margins)
            found.append(
                Room(gap_m, np.where(towards > 0.0, gap_m - needs, np.inf), f"ship {ship} and an obstacle")
            )
    return found


def edge_rooms(asked: Reconfiguration, positions_m: Array, velocities_m_s: Array) -> list[Room]:
    """Room of each ship to each edge of the keep-in region."""
    found = []
    for normal, offset in asked.keep_in.inward() if asked.keep_in is not None else ():
        for ship in range(len(asked.starts_m)):
            gap_m = positions_m[:, ship] @ normal + offset
            towards = -(velocities_m_s[:, ship] @ normal)
            needs = stopping_m(towards, velocities_m_s[:, ship], asked.margins)
            found.append(
                Room(gap_m, np.where(towards > 0.0, gap_m - needs, np.inf), f"ship {ship} and the edge")
            )
    return found


def objection(asked: Reconfiguration, made: Plan) -> str:
    """Why a plan is not safe; empty if it is."""
    t_s = np.linspace(0.0, made.duration_s, max(2, round(made.duration_s / _STEP_S)) + 1)
    positions_m, velocities_m_s = made.sampled(t_s), made.sampled(t_s, 1)
    margins = asked.margins
    fastest = np.hypot(*np.moveaxis(velocities_m_s, -1, 0)).max()
    if fastest > margins.speed_m_s + _ROUNDING_M:
        return f"a ship would need {fastest:.3f} m/s, {margins.speed_m_s:g} m/s are allowed"
    hardest = np.hypot(*np.moveaxis(made.sampled(t_s, 2), -1, 0)).max()
    if hardest > margins.acceleration_m_s2 + _ROUNDING_M:
        return f"a ship would need {hardest:.4f} m/s2, {margins.acceleration_m_s2:g} m/s2 are allowed"
    for among, least_m, stopped_m in (
        (rooms(asked, positions_m, velocities_m_s), margins.gap_m, margins.stopping_gap_m),
        (edge_rooms(asked, positions_m, velocities_m_s), 0.0, margins.edge_gap_m),
    ):
        for room in among:
            when = int(room.gap_m.argmin())
            if room.gap_m[when] < least_m - _ROUNDING_M:
                return (
                    f"{room.who} would come as near as {1e3 * room.gap_m[when]:.0f} mm at {t_s[when]:.1f} s, "
                    f"{1e3 * least_m:.0f} mm are asked for"
                )
            when = int(room.stopping_m.argmin())
            if room.stopping_m[when] < stopped_m - _ROUNDING_M:
                return (
                    f"{room.who} could not be kept {1e3 * stopped_m:.0f} mm apart by braking at "
                    f"{t_s[when]:.1f} s"
                )
    return ""
