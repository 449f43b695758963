"""Motion between frames: Hill's for the centres of mass, Euler's for the turn, seen by a moving camera.

The camera's craft and how it is turned come from outside. A case without them is seen by a camera that floats
without turning: the orbital frame is then the camera's and its rate zero, so that the other craft goes
straight on but for an acceleration that the filter learns, and there is no gravity gradient.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.attitude_motion import Vertical, turn_on
from groundstation.relative_navigation.hill import hill_response, hill_transition

Floats = NDArray[np.float64]
AttitudeOfTime = Callable[[float], Floats]
"""Seconds to ``camera_from_orbital``, (3, 3)."""

STATE = 15
"""Errors of a motion: position in camera axes, turn about camera axes, velocity in orbital axes, rate in body
axes, acceleration in orbital axes."""
POSITION, TURN, VELOCITY, RATE, ACCELERATION = (slice(i, i + 3) for i in range(0, STATE, 3))


_EYE = np.eye(3)


def _fixed(_t_s: float) -> Floats:
    return _EYE


@dataclass(frozen=True, slots=True, eq=False)
class CameraCraft:
    """The craft that carries the camera.

    Attributes:
        orbital_rate_rad_s: Of its orbit; 0: no orbit is known.
        camera_from_orbital: How the camera is turned at a time.
        camera_from_mass_m: Place of the optical centre, camera axes, counted from the craft's centre of
            mass, (3,).
    """

    orbital_rate_rad_s: float = 0.0
    camera_from_orbital: AttitudeOfTime = _fixed
    camera_from_mass_m: Floats = field(default_factory=lambda: np.zeros(3))

    def turned_by(self, begin_s: float, end_s: float) -> Floats:
        """Return the camera's axes at the end from those at the beginning, as inertial space sees them."""
        angle = self.orbital_rate_rad_s * (end_s - begin_s)
        c, s = np.cos(angle), np.sin(angle)
        back = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        found: Floats = self.camera_from_orbital(end_s) @ back @ self.camera_from_orbital(begin_s).T
        return found


@dataclass(eq=False)
class Motions:
    """Motions of m members: what moves is the target's centre of mass.

    Attributes:
        rotation: Camera from body, (m, 3, 3).
        position_m: Camera axes, (m, 3).
        velocity_m_s: In the turning orbital frame, orbital axes, (m, 3).
        rate_rad_s: Absolute, body axes, (m, 3).
        acceleration_m_s2: What Hill's equations do not explain, orbital axes, (m, 3).
    """

    rotation: Floats
    position_m: Floats
    velocity_m_s: Floats
    rate_rad_s: Floats
    acceleration_m_s2: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Unmodelled:
    """White noise that drives what the models leave out, per member.

    Attributes:
        turn: Angular acceleration, rad^2/s^3, (m,).
        along: Change of acceleration along the line of sight, m^2/s^5, (m,).
        across: The same across it, (m,).
    """

    turn: Floats
    along: Floats
    across: Floats


def advance(
    motions: Motions,
    craft: CameraCraft,
    inertia_kg_m2: Floats | None,
    begin_s: float,
    end_s: float,
) -> tuple[Motions, Floats]:
    """Return the motions at the end of a span, and how errors go on: (m, 15, 15)."""
    dt = end_s - begin_s
    n = craft.orbital_rate_rad_s
    begin, end = craft.camera_from_orbital(begin_s), craft.camera_from_orbital(end_s)
    carry, push = hill_transition(n, dt), hill_response(n, dt)
    place = (motions.position_m + craft.camera_from_mass_m) @ begin
    moved = (
        np.concatenate((place, motions.velocity_m_s), axis=1) @ carry.T + motions.acceleration_m_s2 @ push.T
    )
    vertical = None
    if n > 0.0 and inertia_kg_m2 is not None:
        orbital = motions.rotation.transpose(0, 2, 1) @ begin  # columns: orbital axes in the body
        vertical = Vertical(orbital[:, :, 0], orbital[:, :, 2], n)
    turned = turn_on(motions.rate_rad_s, inertia_kg_m2, dt, vertical)
    swing = craft.turned_by(begin_s, end_s)
    rotation = swing @ motions.rotation @ turned.turns
    after = Motions(
        rotation,
        moved[:, :3] @ end.T - craft.camera_from_mass_m,
        moved[:, 3:],
        turned.rates_rad_s,
        motions.acceleration_m_s2,
    )
    carried = np.zeros((len(rotation), STATE, STATE))
    carried[:, POSITION, POSITION] = end @ carry[:3, :3] @ begin.T
    carried[:, POSITION, VELOCITY] = end @ carry[:3, 3:]
    carried[:, POSITION, ACCELERATION] = end @ push[:3]
    carried[:, VELOCITY, POSITION] = carry[3:, :3] @ begin.T
    carried[:, VELOCITY, VELOCITY] = carry[3:, 3:]
    carried[:, VELOCITY, ACCELERATION] = push[3:]
    carried[:, ACCELERATION, ACCELERATION] = _EYE
    carried[:, TURN, TURN] = swing
    carried[:, TURN, RATE] = rotation @ turned.angle_by_rate
    carried[:, RATE, RATE] = turned.rate_by_rate
    return after, carried


def noise_over(motions: Motions, noise: Unmodelled, camera_from_orbital: Floats, dt_s: float) -> Floats:
    """Return the covariance (m, 15, 15) that unmodelled motion adds over a span ending with these."""
    t = dt_s
    sight = motions.position_m @ camera_from_orbital
    sight = sight / np.linalg.norm(sight, axis=1, keepdims=True)
    change = noise.across[:, None, None] * _EYE + (noise.along - noise.across)[:, None, None] * (
        sight[:, :, None] * sight[:, None, :]
    )
    seen = camera_from_orbital @ change
    turn = noise.turn[:, None, None]
    added = np.zeros((len(sight), STATE, STATE))
    added[:, POSITION, POSITION] = seen @ camera_from_orbital.T * (t**5 / 20.0)
    added[:, POSITION, VELOCITY] = seen * (t**4 / 8.0)
    added[:, POSITION, ACCELERATION] = seen * (t**3 / 6.0)
    added[:, VELOCITY, VELOCITY] = change * (t**3 / 3.0)
    added[:, VELOCITY, ACCELERATION] = change * (t**2 / 2.0)
    added[:, ACCELERATION, ACCELERATION] = change * t
    added[:, TURN, TURN] = turn * _EYE * (t**3 / 3.0)
    added[:, TURN, RATE] = turn * motions.rotation * (t**2 / 2.0)
    added[:, RATE, RATE] = turn * _EYE * t
    for one, other in (
        (POSITION, VELOCITY),
        (POSITION, ACCELERATION),
        (VELOCITY, ACCELERATION),
        (TURN, RATE),
    ):
        added[:, other, one] = added[:, one, other].transpose(0, 2, 1)
    return added
