"""The published least squares for the accelerometers' constant offsets (alpha, beta), to the letter.

A separate study, not a part of any estimator: over a stretch whose start state is known, the integrated way
is linear in two unknown constants that are subtracted from the accelerations in the body's axes,

    x_k = fx_k + alpha px_k + beta qx_k        y_k = fy_k + alpha py_k + beta qy_k

with sums as in `travel_sums`, and phi minus the heading:

    fx = x_0 + vx_0 (t_k - t_0) + S[ax cos phi + ay sin phi]    px = -S[cos phi]    qx = -S[sin phi]
    fy = y_0 + vy_0 (t_k - t_0) + S[ay cos phi - ax sin phi]    py =  S[sin phi]    qy = -S[cos phi]

(printed for x; those for y are "analogous"). Minimised is the sum of squared differences to the positions by
stars. With A and f as printed, the printed solution is A^-1 f; but the gradient vanishes where A xi = -f, so
the printed one is the negative of the offsets: both are given. Nothing is weighed and no fix is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.published_steps import travel_sums

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class StretchStart:
    """What is known at the start of a stretch: moment, position and velocity, table frame."""

    t_s: float
    x_m: float
    y_m: float
    vx_m_s: float
    vy_m_s: float


@dataclass(frozen=True, slots=True, eq=False)
class WayInOffsets:
    """The integrated way at each sample, linear in the offsets; shapes (2, n), rows x and y, m."""

    f_m: Array
    p_s2: Array
    """By alpha, in m per m/s^2."""
    q_s2: Array
    """By beta."""

    def at(self, alpha_m_s2: float, beta_m_s2: float) -> Array:
        """Return the way (2, n) with these offsets taken off."""
        return np.asarray(self.f_m + alpha_m_s2 * self.p_s2 + beta_m_s2 * self.q_s2)


@dataclass(frozen=True, slots=True, eq=False)
class PublishedOffsets:
    """Constant offsets to be taken from the accelerometers, body axes.

    Attributes:
        alpha_m_s2: Of x, where the gradient vanishes.
        beta_m_s2: Of y.
        printed: A^-1 f as printed: the negative of both.
        residual_m: Way minus stars at each fix, with the offsets taken off, (2, m).
        residual_rms_m: Of each axis and fix.
        before_rms_m: The same without the offsets.
    """

    alpha_m_s2: float
    beta_m_s2: float
    printed: tuple[float, float]
    residual_m: Array
    residual_rms_m: float
    before_rms_m: float


def way_in_offsets(start: StretchStart, end_s: Array, heading_rad: Array, force_m_s2: Array) -> WayInOffsets:
    """Integrate a stretch as printed.

    Args:
        start: Its start.
        end_s: Moment of each sample, ascending, shape (n,).
        heading_rad: Of each sample, shape (n,).
        force_m_s2: Accelerations in body axes, shape (2, n).
    """
    step_s = np.diff(end_s, prepend=start.t_s)
    phi = -heading_rad
    c, s = np.cos(phi), np.sin(phi)
    ax, ay = force_m_s2
    elapsed = end_s - start.t_s
    sums = travel_sums(np.array([ax * c + ay * s, ay * c - ax * s, c, s]), step_s)
    f = np.array(
        [
            start.x_m + start.vx_m_s * elapsed + sums[0],
            start.y_m + start.vy_m_s * elapsed + sums[1],
        ]
    )
    return WayInOffsets(f, np.array([-sums[2], sums[3]]), np.array([-sums[3], -sums[2]]))


def nearest_samples(end_s: Array, fix_s: Array) -> NDArray[np.intp]:
    """Return k(i): the sample nearest to each fix; assumed, the publication says that it corresponds."""
    after = np.clip(np.searchsorted(end_s, fix_s), 1, len(end_s) - 1)
    return np.asarray(after - (fix_s - end_s[after - 1] <= end_s[after] - fix_s))


def normal_equations(way: WayInOffsets, sample: NDArray[np.intp], star_m: Array) -> tuple[Array, Array]:
    """Return A (2, 2) and f (2,) as printed.

    Args:
        way: Of the stretch.
        sample: k(i) of each fix, shape (m,).
        star_m: Positions by stars, shape (2, m).
    """
    f, p, q = way.f_m[:, sample], way.p_s2[:, sample], way.q_s2[:, sample]
    off = f - star_m
    a = np.array([[np.sum(p * p), np.sum(p * q)], [np.sum(p * q), np.sum(q * q)]])
    return a, np.array([np.sum(p * off), np.sum(q * off)])


def fit_published_offsets(way: WayInOffsets, sample: NDArray[np.intp], star_m: Array) -> PublishedOffsets:
    """Fit (alpha, beta).

    Args:
        way: Of the stretch.
        sample: k(i) of each fix, shape (m,).
        star_m: Positions by stars, shape (2, m).

    Raises:
        ValueError: There is no fix, or the stretch is too short to tell the offsets.
    """
    if len(sample) == 0:
        raise ValueError("the offsets need at least one fix in the stretch, found none")
    a, f = normal_equations(way, sample, star_m)
    if not np.all(np.diag(a) > 0.0):
        raise ValueError("the stretch is too short to tell the offsets")
    printed = np.linalg.solve(a, f)
    alpha, beta = -float(printed[0]), -float(printed[1])
    left = way.at(alpha, beta)[:, sample] - star_m
    before = way.f_m[:, sample] - star_m
    return PublishedOffsets(
        alpha,
        beta,
        (float(printed[0]), float(printed[1])),
        left,
        float(np.sqrt(np.mean(left**2))),
        float(np.sqrt(np.mean(before**2))),
    )
