"""How a motion-capture system's frame lies to the table, and a rigid body on its mock-up. Pure.

The system reports pivot and heading of a rigid body in its own frame; another source reports the pose of the
mock-up in the table's frame, at the same moments. On the table

    o + R(psi) p + v d = c + R(h) q        psi + g = h + k

with p the pivot in the system's frame (z turned up), o its origin, psi its yaw, c and h the mock-up's place
and heading, q the pivot on the mock-up, g the rigid body's heading in the system's frame, k its yaw on the
mock-up, d the delay beyond what the rig states, v its velocity. A mock-up that turns tells q from o;
one that also moves tells psi from k.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

LEAST_PAIRS = 30
LEAST_TURN_RAD, LEAST_SPAN_M = 1.0, 0.3
NAMES = ("origin_x", "origin_y", "yaw", "pivot_x", "pivot_y", "pivot_yaw", "delay")
UNITS = ("m", "m", "rad", "m", "m", "rad", "s")
DELAY_SIGMA_S = 0.02
"""Before the data speak: a mock-up that hardly moves must not make the rest unknown."""
OUTLIER, ROUNDS = 5.0, 6
"""Sigmas from which a pair is left out, and how often that is decided anew: markers are swapped."""


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """One moment each: what the system sees, and where the mock-up is.

    Attributes:
        seen: (n, 3) pivot x, y and heading of the rigid body in the system's frame turned z up.
        pose: (n, 3) x, y, heading of the mock-up in the table frame.
        velocity: (n, 3) its velocity x, y and turn rate.
        sigma: (n, 2) of position and heading, both sources together.
    """

    seen: Array
    pose: Array
    velocity: Array
    sigma: Array

    def __len__(self) -> int:
        return len(self.seen)


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """What was found.

    Attributes:
        value: (7,) as `NAMES`.
        sigma: (7,) one standard deviation each.
        chi_square_ratio: Of the fit; 1 where the sources' sigmas are right.
    """

    value: Array
    sigma: Array
    chi_square_ratio: float


def align(pairs: Pairs) -> Alignment:
    """Find the alignment.

    Raises:
        CalibrationRefusedError: Too few pairs, or the mock-up has hardly turned or moved.
    """
    if len(pairs) < LEAST_PAIRS:
        raise CalibrationRefusedError(f"{len(pairs)} poses were seen by both, {LEAST_PAIRS} are needed")
    turned = float(np.ptp(np.unwrap(pairs.pose[:, 2])))
    if turned < LEAST_TURN_RAD:
        raise CalibrationRefusedError(
            f"the mock-up turned by {math.degrees(turned):.0f} deg: that does not tell the pivot from the "
            f"origin, {math.degrees(LEAST_TURN_RAD):.0f} deg are needed"
        )
    span = float(np.hypot(*np.ptp(pairs.pose[:, :2], axis=0)))
    if span < LEAST_SPAN_M:
        raise CalibrationRefusedError(
            f"the mock-up moved over {span:.2f} m: that does not tell the system's yaw, {LEAST_SPAN_M:g} m "
            "are needed"
        )

    value, kept = _guess(pairs), np.ones(len(pairs), dtype=np.bool_)
    for _ in range(ROUNDS):
        value, jacobian = _fit(_some(pairs, kept), value)
        worst = np.abs(residuals(value, pairs) / pairs.sigma[:, [0, 0, 1]]).max(axis=1)
        # the sources may be worse than they state: what is usual is no outlier
        fits = worst < OUTLIER * max(1.0, float(np.median(worst)))
        if fits.sum() < LEAST_PAIRS or (fits == kept).all():
            break
        kept = fits
    weighed = _weighed(value, _some(pairs, kept))[:-1]
    ratio = float((weighed**2).sum()) / max(1, weighed.size - len(NAMES))
    sigma = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian)) * max(1.0, ratio))
    return Alignment(value, sigma, ratio)


def _some(pairs: Pairs, kept: NDArray[np.bool_]) -> Pairs:
    return Pairs(pairs.seen[kept], pairs.pose[kept], pairs.velocity[kept], pairs.sigma[kept])


def _weighed(value: Array, pairs: Pairs) -> Array:
    """Residuals over their sigmas, and the delay over what is believed beforehand."""
    return np.append((residuals(value, pairs) / pairs.sigma[:, [0, 0, 1]]).ravel(), value[6] / DELAY_SIGMA_S)


def _fit(pairs: Pairs, value: Array) -> tuple[Array, Array]:
    """The best value, and the Jacobian there; a pair that is far off pulls no harder than one that is off."""

    def misfit(at: Array) -> Array:
        return _weighed(at, pairs)

    found = least_squares(misfit, value, x_scale="jac", loss="huber", f_scale=OUTLIER)
    return found.x, np.asarray(found.jac)


def residuals(value: Array, pairs: Pairs) -> Array:
    """Return (n, 3) aligned pose less the other source's: x, y (m), heading (rad)."""
    o_x, o_y, psi, q_x, q_y, k, d_s = value
    p_x, p_y, g = pairs.seen.T
    heading = g + psi - k
    c, s = math.cos(psi), math.sin(psi)
    ch, sh = np.cos(heading), np.sin(heading)
    x = o_x + c * p_x - s * p_y - (ch * q_x - sh * q_y) + pairs.velocity[:, 0] * d_s
    y = o_y + s * p_x + c * p_y - (sh * q_x + ch * q_y) + pairs.velocity[:, 1] * d_s
    turned = heading + pairs.velocity[:, 2] * d_s - pairs.pose[:, 2]
    return np.column_stack((x - pairs.pose[:, 0], y - pairs.pose[:, 1], np.angle(np.exp(1j * turned))))


def _guess(pairs: Pairs) -> Array:
    """Yaw by the ways between poses, the rest by linear least squares at that yaw."""
    seen = pairs.seen[:, 0] + 1j * pairs.seen[:, 1]
    place = pairs.pose[:, 0] + 1j * pairs.pose[:, 1]
    turn = np.exp(1j * pairs.pose[:, 2])
    # place + turn q = o + exp(i psi) seen: linear in q, o and exp(i psi) when its length is left free
    rows = np.column_stack((-turn, np.ones(len(seen)), seen))
    q, o, e = np.linalg.lstsq(rows, place, rcond=None)[0]
    psi = float(np.angle(e))
    k = float(np.angle(np.exp(1j * (pairs.seen[:, 2] + psi - pairs.pose[:, 2])).mean()))
    return np.array([o.real, o.imag, psi, q.real, q.imag, k, 0.0])
