"""The safety filter: the wanted force, changed as little as keeps the mock-up able to stop.

A control barrier function (A. Ames and others, Control barrier functions: theory and applications, 2019). Of
whatever must not be reached, an edge or another body at a distance d, the function is the room that is left
after stopping,

    h = d - v (t + |v| / (2 a)),

with v the speed towards it, a the deceleration to count on and t the time until the valves push, with a
reserve. The force is held to dh/dt >= -k h, a linear condition on it: far away everything is allowed, at
h = 0 what does not bring it nearer, inside what takes it out. Full braking along the velocity satisfies every
one of these conditions while h >= 0 (dh/dt = a t v / |v| then), so there is always a way out; where the
conditions leave nothing that the valves can make, that is what is done. Between two that both move each keeps
to half of the condition (U. Borrmann and others, Control barrier certificates for safe swarm behavior, 2015).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from pydantic import ConfigDict, Field

from groundstation.control.half_planes import HalfPlane, nearest
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import BodyWrench, ControlState, Vector2, rotate
from groundstation.files.plain_model import PlainModel

RESTING_M = 0.06
"""Off an edge or another body: what is held there drifts a little, and nobody should have to brake for it."""
EDGE, TURN_RATE = "edge", "turn rate"
_SLOWEST_BRAKING_M_S2 = 1e-6


class SafetyFilterConfig(PlainModel):
    """How early it takes hold.

    Attributes:
        reaction_s: Age of the state, a modulation period, the opening of a valve.
        reserve_s: Time at the present speed that is left beside the stopping distance; more than the
            supervisor's, which brakes where this does not help.
        gain_per_s: k: how fast the room may be used up.
        share_of_braking: Of the deceleration to count on; the rest is for noise and slope.
        torque_share: Of the largest torque that is left while the force is changed: speed goes first.
        most_rate_rad_s: Turn rate that no torque may lead beyond; where the published inertial navigation
            stops integrating (50 deg/s), with something to spare.
        spin_down_s: Torque falls off linearly when the rate would reach that within so long.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    reaction_s: float = Field(default=0.15, ge=0.0, le=2.0)
    reserve_s: float = Field(default=0.8, ge=0.0, le=5.0)
    gain_per_s: float = Field(default=1.0, gt=0.0, le=5.0)
    share_of_braking: float = Field(default=0.85, gt=0.0, le=1.0)
    torque_share: float = Field(default=0.25, ge=0.0, le=1.0)
    most_rate_rad_s: float = Field(default=0.8, gt=0.0)
    spin_down_s: float = Field(default=0.5, gt=0.0)


class Disc(NamedTuple):
    """A round thing that must not be touched.

    Attributes:
        name: For people.
        position_table_m: Its centre.
        velocity_table_m_s: Of it.
        reach_m: Between the centres where both touch, doubt of both places included.
        share: Of the condition that this mock-up keeps to: a half where the other one does, too, else all.
    """

    name: str
    position_table_m: Vector2
    velocity_table_m_s: Vector2
    reach_m: float
    share: float


class Filtered(NamedTuple):
    """What the filter made of a wanted acceleration.

    Attributes:
        acceleration_table_m_s2: What is safe, (x, y).
        limited_by: Names of what it was changed for; empty where it was not changed.
        must_brake: The conditions leave nothing that the valves can make: full braking is what is left.
    """

    acceleration_table_m_s2: Vector2
    limited_by: tuple[str, ...]
    must_brake: bool


class SafetyFilter:
    """Changes wanted accelerations.

    Args:
        config: How early it takes hold.
        keep_in: Part of the table for the centres of mock-ups.
    """

    def __init__(self, config: SafetyFilterConfig, keep_in: KeepIn) -> None:
        self.config = config
        self.keep_in = keep_in

    def filtered(
        self, wanted_m_s2: Vector2, state: ControlState, discs: Sequence[Disc], braking_m_s2: float
    ) -> Filtered:
        """The nearest safe acceleration.

        Args:
            wanted_m_s2: Of the centre of mass, table axes: what the valves can make.
            state: Newest estimate.
            discs: Other mock-ups and obstacles.
            braking_m_s2: Deceleration to count on, in any direction.
        """
        available_m_s2 = max(braking_m_s2, _SLOWEST_BRAKING_M_S2)
        braking_m_s2 = max(self.config.share_of_braking * braking_m_s2, _SLOWEST_BRAKING_M_S2)
        planes = [
            *self._edges(state, braking_m_s2),
            *(self._disc(state, disc, braking_m_s2) for disc in discs),
        ]
        found = nearest(wanted_m_s2, planes)
        if found is not None and not found.active:
            return Filtered(wanted_m_s2, (), must_brake=False)
        if found is None or math.hypot(*found.point) > available_m_s2:
            broken = [plane for plane in planes if _along(plane.normal, wanted_m_s2) > plane.bound]
            return Filtered((0.0, 0.0), _names(broken), must_brake=True)
        return Filtered(found.point, _names(found.active), must_brake=False)

    def resting_place(self, position_table_m: Vector2, discs: Sequence[Disc]) -> Vector2:
        """Where to hold a place: the nearest one that is a little off everything; itself where none is."""
        planes = [
            HalfPlane((-inward[0], -inward[1]), offset - RESTING_M, EDGE)
            for inward, offset in self.keep_in.inward()
        ]
        for disc in discs:
            towards, _ = _towards(position_table_m, disc.position_table_m)
            bound = _along(towards, disc.position_table_m) - disc.reach_m - RESTING_M
            planes.append(HalfPlane(towards, bound, disc.name))
        found = nearest(position_table_m, planes)
        return position_table_m if found is None else found.point

    def turned(self, wanted_rad_s2: float, rate_rad_s: float) -> float:
        """The nearest angular acceleration that does not lead beyond the largest turn rate."""
        room = self.config.most_rate_rad_s / self.config.spin_down_s
        now = rate_rad_s / self.config.spin_down_s
        return min(max(wanted_rad_s2, -room - now), room - now)

    def _edges(self, state: ControlState, braking_m_s2: float) -> list[HalfPlane]:
        distances_m = self.keep_in.edge_distances_m(state.position_table_m)
        return [
            self._condition(EDGE, (-inward[0], -inward[1]), distance_m, state, 0.0, 0.0, 1.0, braking_m_s2)
            for (inward, _), distance_m in zip(self.keep_in.inward(), distances_m, strict=True)
        ]

    def _disc(self, state: ControlState, disc: Disc, braking_m_s2: float) -> HalfPlane:
        towards, apart_m = _towards(state.position_table_m, disc.position_table_m)
        theirs_m_s = -_along(disc.velocity_table_m_s, towards)  # towards this mock-up
        stopping_s = self._stopping_s(math.hypot(*disc.velocity_table_m_s), braking_m_s2)
        way_m = max(theirs_m_s, 0.0) * stopping_s
        return self._condition(
            disc.name, towards, apart_m - disc.reach_m, state, way_m, theirs_m_s, disc.share, braking_m_s2
        )

    def _stopping_s(self, speed_m_s: float, braking_m_s2: float) -> float:
        """Way to rest over speed, reserve included."""
        return self.config.reaction_s + self.config.reserve_s + speed_m_s / (2.0 * braking_m_s2)

    def _condition(
        self,
        whose: str,
        towards: Vector2,
        distance_m: float,
        state: ControlState,
        their_way_m: float,
        theirs_m_s: float,
        share: float,
        braking_m_s2: float,
    ) -> HalfPlane:
        """dh/dt >= -k h as a condition on the acceleration.

        dh/dt = -v - (T n + v w / (2 a)) . u with T the stopping time and w the direction of the velocity; the
        slope adds to u.
        """
        velocity = state.velocity_table_m_s
        speed_m_s = math.hypot(*velocity)
        approach_m_s = _along(velocity, towards)
        stopping_s = self._stopping_s(speed_m_s, braking_m_s2)
        room_m = distance_m - max(approach_m_s, 0.0) * stopping_s - their_way_m
        turned = max(approach_m_s, 0.0) / (2.0 * braking_m_s2 * speed_m_s) if speed_m_s > 0.0 else 0.0
        normal = (
            stopping_s * towards[0] + turned * velocity[0],
            stopping_s * towards[1] + turned * velocity[1],
        )
        # who is run into by another one keeps to its part of what the other one uses up
        closing_m_s = approach_m_s + (theirs_m_s if share == 1.0 else 0.0)
        bound = share * self.config.gain_per_s * room_m - closing_m_s
        return HalfPlane(normal, bound - _along(normal, state.slope_table_m_s2), whose)


def table_acceleration(wrench: BodyWrench, heading_rad: float, mass_kg: float) -> Vector2:
    """Acceleration of the centre of mass, table axes."""
    force = rotate(wrench.force_body_n, heading_rad)
    return force[0] / mass_kg, force[1] / mass_kg


def body_force(acceleration_table_m_s2: Vector2, heading_rad: float, mass_kg: float) -> Vector2:
    """Force that gives an acceleration, body axes."""
    x, y = rotate(acceleration_table_m_s2, -heading_rad)
    return mass_kg * x, mass_kg * y


def _towards(here: Vector2, there: Vector2) -> tuple[Vector2, float]:
    """Unit vector and distance; some direction where both are one place."""
    dx, dy = there[0] - here[0], there[1] - here[1]
    apart_m = math.hypot(dx, dy)
    return ((dx / apart_m, dy / apart_m) if apart_m > 0.0 else (1.0, 0.0)), apart_m


def _along(a: Vector2, b: Vector2) -> float:
    return a[0] * b[0] + a[1] * b[1]


def _names(planes: Sequence[HalfPlane]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(plane.whose for plane in planes))
