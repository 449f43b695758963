"""Scale, axes and offset of the accelerometers from rests at several tilts or headings.

At rest reading = b + A f with the specific force f along the block's true axes: g sin(angle above the
horizontal) of each axis on gauge blocks, -R(heading)^T slope on a table. A = 1 + E holds scale and axes; b, E
and what is not known of the slope are fitted together by weighted least squares with wide priors, so that
what the rests do not show keeps its prior's sigma and is reported as unknown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError

Array = NDArray[np.float64]

G_M_S2 = 9.80665
"""Standard gravity (3rd CGPM, 1901)."""
PRIOR_OFFSET_M_S2 = 1.0
PRIOR_AXES = 0.1
"""No part is off by more than a tenth."""
PRIOR_SLOPE_M_S2 = 0.5
"""Of a table that nothing is known of, tilted on purpose or not."""
UNKNOWN_SHARE = 0.3
"""A sigma above this share of its prior's means that the rests say nothing."""
LEAST_RESTS = 3
ITERATIONS = 8


@dataclass(frozen=True, slots=True)
class Rest:
    """One rest: what was read, and what is known of how the block stood."""

    reading_m_s2: tuple[float, float]
    reading_sigma_m_s2: tuple[float, float]
    tilt_rad: tuple[float, float] | None = None
    """Of the body's x and y axis above the horizontal, as given by gauge blocks; None on the bare table."""
    tilt_sigma_rad: float = 0.0
    heading_rad: float | None = None
    """By the stars."""
    heading_sigma_rad: float = 0.0
    slope_m_s2: tuple[float, float] = (0.0, 0.0)
    """The table's known pull at that place."""


@dataclass(frozen=True, slots=True, eq=False)
class TiltAxes:
    """Result; E is (2, 2): reading = offset + (1 + E) f."""

    offset_m_s2: Array
    """(2,)."""
    axes: Array
    """(2, 2) E; its inverse map is f = (1 - M)(reading - offset) with M = 1 - (1 + E)^-1."""
    slope_m_s2: Array
    """(2,) of the table beyond what was known of it; zeros if no heading is known."""
    covariance: Array
    """(8, 8) of offset, M (row by row) and slope, with its priors."""
    unknown: tuple[str, ...]
    """What the rests cannot tell, in words."""
    residual_m_s2: Array
    """(n, 2)."""
    residual_sigma_m_s2: Array
    """(n, 2) expected."""
    chi_square_ratio: float

    @property
    def matrix(self) -> Array:
        """(2, 2) M of f = (1 - M)(reading - offset)."""
        return np.asarray(np.eye(2) - np.linalg.inv(np.eye(2) + self.axes))

    def is_known(self, index: int) -> bool:
        """Whether a row of the covariance has been measured, rather than assumed."""
        prior = _prior(known_slope_sigma_m_s2=0.0)[index]
        return bool(math.sqrt(self.covariance[index, index]) < UNKNOWN_SHARE * prior)


def _prior(known_slope_sigma_m_s2: float) -> Array:
    slope = known_slope_sigma_m_s2 or PRIOR_SLOPE_M_S2
    return np.array([PRIOR_OFFSET_M_S2] * 2 + [PRIOR_AXES] * 4 + [slope] * 2)


def tilt_axes(rests: Sequence[Rest], slope_sigma_m_s2: float | None = None) -> TiltAxes:
    """Fit offset, axes and slope to rests.

    Args:
        rests: at least three; on the bare table each with a heading.
        slope_sigma_m_s2: of the slope that the rests say is known; None if nothing is known of it.

    Raises:
        CalibrationRefusedError: too few rests, one without tilt and heading, or nothing but the offset can be
            learned.
    """
    if len(rests) < LEAST_RESTS:
        raise CalibrationRefusedError(f"at least {LEAST_RESTS} rests are needed, found {len(rests)}")
    if any(rest.tilt_rad is None and rest.heading_rad is None for rest in rests):
        raise CalibrationRefusedError(
            "a rest on the bare table needs a heading by the stars, or give the tilts of all rests"
        )
    sigma0 = _prior(known_slope_sigma_m_s2=slope_sigma_m_s2 or 0.0)
    if all(rest.heading_rad is None for rest in rests):
        sigma0[6:] = 1e-9  # one heading, unknown: whatever the base's level adds is part of the offset
    x = np.zeros(8)
    readings = np.array([rest.reading_m_s2 for rest in rests])
    for _ in range(ITERATIONS):
        rows, left, weight = [], [], []
        for rest, reading in zip(rests, readings, strict=True):
            f, turn, sigma = _force(rest, x)
            rows.append(_jacobian(x, f, turn))
            left.append(reading - x[:2] - (np.eye(2) + x[2:6].reshape(2, 2)) @ f)
            weight.append(1.0 / sigma)
        A, r, w = np.vstack(rows), np.concatenate(left), np.concatenate(weight)
        normal = (A * w[:, None] ** 2).T @ A + np.diag(sigma0**-2)
        step = np.linalg.solve(normal, (A * w[:, None] ** 2).T @ r - x / sigma0**2)
        x = x + step
        if np.abs(step / sigma0).max() < 1e-9:
            break
    fit_covariance = np.linalg.inv(normal)
    learned = int((np.sqrt(np.diag(fit_covariance)) < UNKNOWN_SHARE * sigma0).sum())
    chi = float((w * r) @ (w * r)) / max(1, r.size - learned)
    data = fit_covariance * max(1.0, chi)  # worse than stated is believed, better is not
    keep = np.sqrt(np.diag(fit_covariance)) >= UNKNOWN_SHARE * sigma0
    data[keep] = fit_covariance[keep]
    data[:, keep] = fit_covariance[:, keep]
    E = x[2:6].reshape(2, 2)
    inverse = np.linalg.inv(np.eye(2) + E)
    to_matrix = np.eye(8)
    to_matrix[2:6, 2:6] = np.kron(inverse, inverse.T)  # dM = inv dE inv
    covariance = to_matrix @ data @ to_matrix.T
    result = TiltAxes(x[:2], E, x[6:], covariance, (), r.reshape(-1, 2), 1.0 / w.reshape(-1, 2), chi)
    words = _unknown(result, has_slope=bool(sigma0[6] > 1e-6))
    if not any(result.is_known(k) for k in range(2, 6)) and _combination_sigma(result, (1, 0, 0, -1)) > 0.03:
        raise CalibrationRefusedError(
            "the rests are too alike to tell scale or axes: tilt further (gauge blocks), or turn through "
            "more headings on a table that is tilted by some mrad"
        )
    return TiltAxes(
        result.offset_m_s2, E, result.slope_m_s2, covariance, words, result.residual_m_s2,
        result.residual_sigma_m_s2, chi,
    )  # fmt: skip


def combination(found: TiltAxes, weights: tuple[float, float, float, float]) -> tuple[float, float]:
    """Return value and sigma of a weighted sum of M's entries, row by row."""
    return float(np.dot(weights, found.matrix.ravel())), _combination_sigma(found, weights)


def _combination_sigma(found: TiltAxes, weights: tuple[float, ...]) -> float:
    row = np.zeros(8)
    row[2:6] = weights
    return math.sqrt(float(row @ found.covariance @ row))


def _force(rest: Rest, x: Array) -> tuple[Array, Array, Array]:
    """Return specific force (2,), R(heading)^T or zeros (2, 2), and the sigma (2,) of a reading."""
    turn = np.zeros((2, 2))
    force = np.zeros(2)
    if rest.heading_rad is not None:
        c, s = math.cos(rest.heading_rad), math.sin(rest.heading_rad)
        turn = np.array([[c, s], [-s, c]])
        force = -turn @ (np.array(rest.slope_m_s2) + x[6:])
    placed = rest.heading_sigma_rad * float(np.hypot(*force))
    if rest.tilt_rad is not None:
        force = force + G_M_S2 * np.sin(rest.tilt_rad)
        placed = math.hypot(placed, G_M_S2 * rest.tilt_sigma_rad)
    return force, turn, np.hypot(rest.reading_sigma_m_s2, placed)


def _jacobian(x: Array, f: Array, turn: Array) -> Array:
    """Return (2, 8) of a reading by offset, E row by row, and slope."""
    J = np.zeros((2, 8))
    J[0, 0] = J[1, 1] = 1.0
    J[0, 2:4] = J[1, 4:6] = f
    J[:, 6:] = -(np.eye(2) + x[2:6].reshape(2, 2)) @ turn
    return J


def _unknown(found: TiltAxes, *, has_slope: bool) -> tuple[str, ...]:
    words = []
    diagonal = [found.is_known(k) for k in (2, 5)]
    cross = [found.is_known(k) for k in (3, 4)]
    if not all(diagonal):
        words.append(
            "the common scale of both axes: the slope's size is not known"
            if has_slope and not any(diagonal)
            else "the scale of an axis that was hardly tilted"
        )
    if not all(cross):
        words.append(
            "the common turn of both axes: the slope's direction is not known"
            if has_slope and not any(cross)
            else "the angle of an axis: the other was hardly tilted"
        )
    if not all(found.is_known(k) for k in (0, 1)):
        words.append("the offset: without other headings the base's own tilt is part of it")
    return tuple(words)
