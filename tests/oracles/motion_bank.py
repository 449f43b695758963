"""What ``motion_bank.c`` does, in NumPy: Hill's for the centres of mass, Euler's for the turn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.hill import hill_response, hill_transition
from groundstation.relative_navigation.motion import (
    ACCELERATION,
    POSITION,
    RATE,
    STATE,
    TURN,
    VELOCITY,
    CameraCraft,
)
from groundstation.relative_navigation.motion_bank import FrameInformation
from groundstation.relative_navigation.rotations import rotation_vectors, turns
from oracles.attitude_motion import Vertical, turn_on

Floats = NDArray[np.float64]
_EYE, _EYE6, _EYE15 = np.eye(3), np.eye(6), np.eye(STATE)


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


def update(motions: Motions, before: Floats, frame: FrameInformation) -> tuple[Motions, Floats, Floats]:
    """Return members, their covariances and likelihoods after a frame."""
    count = len(before)
    off = np.empty((count, 6))
    off[:, :3] = motions.position_m - frame.pose.position_camera_m
    off[:, 3:] = rotation_vectors(motions.rotation @ frame.pose.camera_from_body.T)
    weighed = off @ frame.information
    slope = frame.gradient - weighed
    top = before[:, :6, :]
    spread = _EYE6 + frame.information @ top[:, :, :6]
    gain = np.linalg.solve(spread.transpose(0, 2, 1), top).transpose(0, 2, 1)
    step = (gain @ slope[:, :, None])[:, :, 0]
    leak = gain @ frame.information
    keep = np.broadcast_to(_EYE15, (count, STATE, STATE)).copy()
    keep[:, :, :6] -= leak
    covariance = keep @ before @ keep.transpose(0, 2, 1) + leak @ gain.transpose(0, 2, 1)
    explained = (slope * step[:, :6]).sum(axis=1)
    missed = 2.0 * (off @ frame.gradient) - (off * weighed).sum(axis=1)
    likelihood = 0.5 * (explained + missed - np.linalg.slogdet(spread)[1] - frame.cost)
    rotation = turns(step[:, TURN]) @ motions.rotation
    moved = Motions(
        rotation @ (1.5 * _EYE - 0.5 * (rotation.transpose(0, 2, 1) @ rotation)),
        motions.position_m + step[:, POSITION],
        motions.velocity_m_s + step[:, VELOCITY],
        motions.rate_rad_s + step[:, RATE],
        motions.acceleration_m_s2 + step[:, ACCELERATION],
    )
    return moved, 0.5 * (covariance + covariance.transpose(0, 2, 1)), likelihood
