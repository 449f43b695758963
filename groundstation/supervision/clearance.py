"""Whether two mock-ups can both stop before they touch."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from groundstation.control.edge import EdgeVerdict
from groundstation.control.state import ControlState, Vector2

RESERVE_M = 0.03
"""Room after stopping below which braking is asked for."""


class Clearance(NamedTuple):
    """The other vehicle that is met first.

    Attributes:
        verdict: What to do.
        name: Of the other vehicle; empty where there is none.
        room_m: Between the bodies after both have stopped; negative where they touch.
    """

    verdict: EdgeVerdict
    name: str
    room_m: float


def clearance(
    state: ControlState,
    others: Mapping[str, ControlState],
    braking_m_s2: float,
    *,
    reaction_s: float,
    radius_m: float,
    reserve_m: float = RESERVE_M,
) -> Clearance:
    """Whether the mock-up must brake for another one, both braking at once.

    Args:
        state: Newest estimate of this one.
        others: Of the others.
        braking_m_s2: Deceleration to count on, of each.
        reaction_s: Age of the state plus the time until the valves push.
        radius_m: Of each body.
        reserve_m: Room after stopping below which braking is asked for.
    """
    first = Clearance(EdgeVerdict.CLEAR, "", math.inf)
    for name, other in others.items():
        dx = other.position_table_m[0] - state.position_table_m[0]
        dy = other.position_table_m[1] - state.position_table_m[1]
        apart_m = math.hypot(dx, dy)
        towards = (dx / apart_m, dy / apart_m) if apart_m > 0.0 else (1.0, 0.0)
        own_m_s = _along(state.velocity_table_m_s, towards)
        closing_m_s = own_m_s - _along(other.velocity_table_m_s, towards)
        if own_m_s <= 0.0 or closing_m_s <= 0.0:
            continue  # it goes away, stands, or is run into: then the other one has to brake
        way_m = _stopping_m(state, own_m_s, braking_m_s2, reaction_s)
        theirs_m_s = -_along(other.velocity_table_m_s, towards)
        if theirs_m_s > 0.0:
            way_m += _stopping_m(other, theirs_m_s, braking_m_s2, reaction_s)
        room_m = apart_m - 2.0 * radius_m - way_m
        if room_m < first.room_m:
            first = Clearance(_verdict(room_m, reserve_m), name, room_m)
    return first


def _along(velocity_m_s: Vector2, towards: Vector2) -> float:
    return velocity_m_s[0] * towards[0] + velocity_m_s[1] * towards[1]


def _stopping_m(state: ControlState, speed_m_s: float, braking_m_s2: float, reaction_s: float) -> float:
    """Way along the line between both: braking acts along the velocity, not along that line."""
    whole_m_s = math.hypot(*state.velocity_table_m_s)
    return speed_m_s * (reaction_s + whole_m_s / (2.0 * braking_m_s2))


def _verdict(room_m: float, reserve_m: float) -> EdgeVerdict:
    if room_m >= reserve_m:
        return EdgeVerdict.CLEAR
    return EdgeVerdict.BRAKE if room_m >= 0.0 else EdgeVerdict.TOO_LATE
