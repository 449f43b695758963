"""The corridor to a docking port: where a pair may come near, and how fast.

It opens from the port of the target along the port's axis and turns with the target, as approach corridors of
spacecraft do (W. Fehse, Automated Rendezvous and Docking of Spacecraft, 2003, section 4.4; hold points and
retreat in 5.7). Outside it everybody keeps away from everybody.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from groundstation.control.state import ControlState, Vector2, rotate

_GATE = 0.8  # of the corridor's length: the gate lies inside, so that nobody keeps it away from there
_TOO_FAST = 1.6  # times the speed that is meant at a distance ...
_TOO_FAST_M_S = 0.006  # ... and what estimates are off by


class Relative(NamedTuple):
    """A ship as seen from the port's axis, which turns with the target.

    Attributes:
        along_m: From the target's centre along the axis.
        aside_m: Across, left of the axis is positive.
        closing_m_s: Towards the target along the axis.
        sliding_m_s: Across.
    """

    along_m: float
    aside_m: float
    closing_m_s: float
    sliding_m_s: float


@dataclass(frozen=True, slots=True)
class Corridor:
    """A corridor.

    Attributes:
        axis_rad: Of the port in the target's body, counter-clockwise from its +x.
        half_angle_rad: Of the cone.
        length_m: From contact outwards.
        contact_m: Between the centres at contact.
        lateral_m: Half of its width at contact.
        approach_m_s: Largest closing speed that is meant.
        contact_m_s: Closing speed that is meant at contact.
        slowing_m_s2: Deceleration between both.
    """

    axis_rad: float
    half_angle_rad: float
    length_m: float
    contact_m: float
    lateral_m: float
    approach_m_s: float
    contact_m_s: float
    slowing_m_s2: float

    @property
    def gate_m(self) -> float:
        """From the target's centre along the axis: there a ship waits before it comes in."""
        return self.contact_m + _GATE * self.length_m

    def relative(self, ship: ControlState, target: ControlState) -> Relative:
        """Where a ship is and how it moves, seen from the axis."""
        way = (
            ship.position_table_m[0] - target.position_table_m[0],
            ship.position_table_m[1] - target.position_table_m[1],
        )
        # less the velocity that the turning corridor has there
        moving = (
            ship.velocity_table_m_s[0] - target.velocity_table_m_s[0] + target.rate_rad_s * way[1],
            ship.velocity_table_m_s[1] - target.velocity_table_m_s[1] - target.rate_rad_s * way[0],
        )
        back_rad = -(target.heading_rad + self.axis_rad)
        (along, aside), (parting, sliding) = rotate(way, back_rad), rotate(moving, back_rad)
        return Relative(along, aside, -parting, sliding)

    def speed_m_s(self, gap_m: float) -> float:
        """Closing speed that is meant at a gap."""
        slowed = math.sqrt(self.contact_m_s**2 + 2.0 * self.slowing_m_s2 * max(gap_m, 0.0))
        return min(self.approach_m_s, slowed)

    def objection(self, ship: ControlState, target: ControlState) -> str:
        """Why a ship has no business so near to the target; empty inside the corridor."""
        along_m, aside_m, closing_m_s, _ = self.relative(ship, target)
        gap_m = along_m - self.contact_m
        if along_m < 0.5 * self.contact_m or gap_m > self.length_m:
            return "it is not before the port"
        if abs(aside_m) > self.lateral_m + math.tan(self.half_angle_rad) * max(gap_m, 0.0):
            return f"it is {1e3 * abs(aside_m):.0f} mm beside the axis"
        if closing_m_s > _TOO_FAST * self.speed_m_s(gap_m) + _TOO_FAST_M_S:
            return f"it closes in at {1e3 * closing_m_s:.0f} mm/s"
        return ""

    def place(self, target: ControlState, along_m: float) -> tuple[Vector2, Vector2]:
        """A place on the axis, and the velocity with which it moves."""
        arm = rotate((along_m, 0.0), target.heading_rad + self.axis_rad)
        (x, y), (vx, vy) = target.position_table_m, target.velocity_table_m_s
        rate = target.rate_rad_s
        return (x + arm[0], y + arm[1]), (vx - rate * arm[1], vy + rate * arm[0])


class Docking(NamedTuple):
    """A pair that may touch inside its corridor."""

    ship: str
    target: str
    corridor: Corridor


def may_touch(own: str, dockings: Sequence[Docking], states: Mapping[str, ControlState]) -> frozenset[str]:
    """Names of those that a mock-up may touch now.

    Args:
        own: Its name.
        dockings: All pairs of the rig.
        states: Of all that are known, by name.
    """
    found = set()
    for ship, target, corridor in dockings:
        if own not in (ship, target) or ship not in states or target not in states:
            continue
        if not corridor.objection(states[ship], states[target]):
            found.add(target if own == ship else ship)
    return frozenset(found)
