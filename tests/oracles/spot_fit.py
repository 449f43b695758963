"""Sub-pixel centres of spots from their pixels; ``core/spot_fit.c`` has the same formulas."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from oracles.robust import middle_value

Vector = NDArray[np.float64]

_STEPS, _STREAK_STEPS = 2, 3
_ROOT_2PI = float(np.sqrt(2.0 * np.pi))
_MAX_STEP_PX, _MAX_TURN_RAD, _MIN_HALF_PX = 2.0, 0.3, 0.5
_OUTLIER_SIGMAS = 5.0
_MISFIT_RATIO = 0.3  # the true image is no Gaussian: so much of the model is no outlier
_STREAK_RATIO2 = 2.0  # long over short axis, squared, from where one spot counts as a streak
_MOVING_RATIO2 = 1.25  # the same, from where half of the spots say that all are streaks
_MIN_STREAK2_PX2 = 0.3  # spread along a streak that a fit begins with
_MAX_FIT_PX = 2000  # what covers more is a lamp or a window, no star: its moments do
_TRUNCATION = 1.12  # second moments over a finite footprint come out this much too small
_WIDTH2_LIMITS_PX2 = (0.3, 16.0)
_TOLD_SHARE = 1e-9  # an unknown of which the others leave less is held


@dataclass(frozen=True, eq=False)
class SpotPixels:
    """Pixels of all spots in one row, spot after spot.

    Attributes:
        u_px: Column of every pixel, shape (p,).
        v_px: Row of every pixel, shape (p,).
        light_dn: Light above the background, shape (p,).
        variance_dn2: Variance of a pixel without the star's own shot noise, shape (p,).
        is_saturated: Only a lower bound, shape (p,).
        size: Pixels of every spot, shape (n,).
        gain_dn_per_electron: Shot-noise variance per DN of light.
    """

    u_px: Vector
    v_px: Vector
    light_dn: Vector
    variance_dn2: Vector
    is_saturated: NDArray[np.bool_]
    size: NDArray[np.int64]
    gain_dn_per_electron: float

    @cached_property
    def starts(self) -> NDArray[np.int64]:
        """First pixel of every spot, shape (n,)."""
        return np.concatenate(([0], np.cumsum(self.size)[:-1]))

    @cached_property
    def owner(self) -> NDArray[np.int64]:
        """Spot of every pixel, shape (p,)."""
        return np.repeat(np.arange(len(self.size)), self.size)

    def keep(self, spots: NDArray[np.bool_]) -> "SpotPixels":
        """Give the pixels of some spots only."""
        pixel = np.repeat(spots, self.size)
        return SpotPixels(
            self.u_px[pixel],
            self.v_px[pixel],
            self.light_dn[pixel],
            self.variance_dn2[pixel],
            self.is_saturated[pixel],
            self.size[spots],
            self.gain_dn_per_electron,
        )


@dataclass(frozen=True, slots=True, eq=False)
class FittedSpots:
    """Centres, light and shape of spots; arrays of one entry per spot as in ``Spots``."""

    u_px: Vector
    v_px: Vector
    flux_dn: Vector
    covariance_px2: Vector
    elongation: Vector
    streak_px: Vector


def fit_spots(pixels: SpotPixels) -> FittedSpots:
    """Fit every spot's centre and light, and of streaks length and direction, all spots at once.

    Moments give the first guess and the shape: one width for the picture, and a streak for every spot
    whose second moments say so, or for all of a picture that was taken in motion. Then Gauss-Newton steps
    fit a Gaussian of that width (a line blurred by it, for streaks) to the pixels, weighted by read and
    shot noise, saturated pixels and outliers left out.
    """
    guess = _moments(pixels)
    width2, half, angle = _shapes(guess)
    first = np.stack((guess.u_px, guess.v_px, guess.flux_dn, half, angle))
    at, covariance = first.copy(), guess.covariance_px2.copy()
    for is_streak in (False, True):
        some = ((half > 0.0) == is_streak) & (pixels.size <= _MAX_FIT_PX)
        if some.any():
            fitted, of_centre, trusted = _gauss_newton(pixels.keep(some), first[:, some], width2, is_streak)
            found = np.flatnonzero(some)[trusted]
            at[:, found], covariance[:, found] = fitted[:, trusted], of_centre[:, trusted]
    u, v, flux, half, angle = at
    return FittedSpots(
        u_px=u,
        v_px=v,
        flux_dn=flux,
        covariance_px2=covariance.T.copy(),
        elongation=np.sqrt(1.0 + half * half / (3.0 * width2)),
        streak_px=np.stack((2.0 * half * np.cos(angle), 2.0 * half * np.sin(angle)), axis=1),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Moments:
    """Zeroth to second moments: light, centre, spread (uu, uv, vv; (3, n)), covariance of the centre."""

    flux_dn: Vector
    u_px: Vector
    v_px: Vector
    spread_px2: Vector
    covariance_px2: Vector


def _moments(pixels: SpotPixels) -> _Moments:
    starts, owner = pixels.starts, pixels.owner
    light = pixels.light_dn
    flux = np.maximum(np.add.reduceat(light, starts), 1e-9)
    u = np.add.reduceat(light * pixels.u_px, starts) / flux
    v = np.add.reduceat(light * pixels.v_px, starts) / flux
    du, dv = pixels.u_px - u[owner], pixels.v_px - v[owner]
    square = np.stack((du * du, du * dv, dv * dv))
    variance = pixels.variance_dn2 + pixels.gain_dn_per_electron * np.maximum(light, 0.0)
    spread = np.add.reduceat(light * square, starts, axis=1) / flux
    covariance = np.add.reduceat(variance * square, starts, axis=1) / flux**2
    return _Moments(flux, u, v, spread, covariance)


def _shapes(moments: _Moments) -> tuple[float, Vector, Vector]:
    """Give the width squared, and of every spot half the length (0: round) and direction of its streak."""
    uu, uv, vv = moments.spread_px2
    half, spread = 0.5 * (uu + vv), np.hypot(0.5 * (uu - vv), uv)
    width2 = min(max(_TRUNCATION * middle_value(half - spread), _WIDTH2_LIMITS_PX2[0]), _WIDTH2_LIMITS_PX2[1])
    ratio = (half + spread) / np.maximum(half - spread, width2 / _TRUNCATION)
    streaked = (ratio > _STREAK_RATIO2) | (middle_value(ratio) > _MOVING_RATIO2)
    # The part of the spread beyond the round image is the streak's: a line of length l spreads l^2 / 12.
    extra = np.maximum(half + spread - width2, _MIN_STREAK2_PX2)
    angle = 0.5 * np.arctan2(2.0 * uv, uu - vv)
    return width2, np.where(streaked, np.sqrt(3.0 * extra), 0.0), np.where(streaked, angle, 0.0)


def _round_image(du: Vector, dv: Vector, flux: Vector, width2: float) -> tuple[Vector, ...]:
    """Image of light one; derivatives of the spot by its centre and light."""
    unit = np.exp(-0.5 * (du * du + dv * dv) / width2) / (2.0 * np.pi * width2)
    return flux * unit * du / width2, flux * unit * dv / width2, unit


def _line_image(
    du: Vector, dv: Vector, flux: Vector, half: Vector, angle: Vector, width: float
) -> tuple[Vector, ...]:
    """The same of a line, and by half its length and by its ends moving sideways."""
    c, s = np.cos(angle), np.sin(angle)
    along, off = du * c + dv * s, dv * c - du * s
    front, back = (along + half) / width, (along - half) / width
    at_front, at_back = np.exp(-0.5 * front * front), np.exp(-0.5 * back * back)
    side = np.exp(-0.5 * (off / width) ** 2) / (width * _ROOT_2PI)
    unit = (ndtr(front) - ndtr(back)) / (2.0 * half) * side
    ends = side / (2.0 * half * width * _ROOT_2PI)
    by_along, by_across = (at_back - at_front) * ends, unit * off / width**2
    return (
        flux * (by_along * c - by_across * s),
        flux * (by_along * s + by_across * c),
        unit,
        flux * ((at_front + at_back) * ends - unit / half),
        flux * (by_across * along - by_along * off) / half,
    )


def _gauss_newton(
    pixels: SpotPixels, first: Vector, width2: float, is_streak: bool
) -> tuple[Vector, Vector, NDArray[np.bool_]]:
    """Fit centre, light, half length and angle (5, n); give also the centre's covariance (3, n), and whether
    to trust it."""
    starts, owner = pixels.starts, pixels.owner
    at, usable = first.copy(), ~pixels.is_saturated
    trusted, covariance = np.ones(len(starts), dtype=bool), np.zeros((3, len(starts)))
    steps = _STREAK_STEPS if is_streak else _STEPS
    for step in range(steps):
        u, v, flux, half, angle = at[:, owner]
        du, dv = pixels.u_px - u, pixels.v_px - v
        if is_streak:
            slope = np.stack(_line_image(du, dv, flux, half, angle, float(np.sqrt(width2))))
        else:
            slope = np.stack(_round_image(du, dv, flux, width2))
        model = flux * slope[2]
        error = pixels.light_dn - model
        variance = pixels.variance_dn2 + pixels.gain_dn_per_electron * np.maximum(model, 0.0)
        if step == steps - 1:
            usable = usable & (error * error < _OUTLIER_SIGMAS**2 * variance + (_MISFIT_RATIO * model) ** 2)
        weighted = slope * (usable / variance)
        normal = np.add.reduceat(weighted[:, None] * slope, starts, axis=2)
        gradient = np.add.reduceat(weighted * error, starts, axis=1)
        for spot in np.flatnonzero(trusted):
            solved = _solve(normal[..., spot], gradient[:, spot])
            trusted[spot] = solved is not None
            if solved is not None:
                x, covariance[:, spot] = solved
                at[:3, spot] += x[:3]
                if is_streak:
                    low, high = max(0.5 * at[3, spot], _MIN_HALF_PX), max(1.5 * at[3, spot], _MIN_HALF_PX)
                    at[3, spot] = np.clip(at[3, spot] + x[3], low, high)
                    at[4, spot] += np.clip(x[4] / at[3, spot], -_MAX_TURN_RAD, _MAX_TURN_RAD)
    trusted &= at[2] > 0.0
    return at, covariance, trusted


def _solve(normal: Vector, gradient: Vector) -> tuple[Vector, tuple[float, float, float]] | None:
    """One step and the centre's covariance; None where it cannot be trusted."""
    n, g, x = normal.copy(), gradient.copy(), np.zeros(len(gradient))
    alone, told = np.diag(normal).copy(), []
    for k in range(len(g) - 1, 1, -1):
        if n[k, k] > _TOLD_SHARE * alone[k]:
            ratio = n[:k, k] / n[k, k]
            n[:k, :k] -= np.outer(ratio, n[k, :k])
            g[:k] -= ratio * g[k]
            told.append(k)
    determinant = n[0, 0] * n[1, 1] - n[0, 1] ** 2
    if not (determinant > 0.0 and n[0, 0] > 0.0):
        return None
    x[:2] = np.array([[n[1, 1], -n[0, 1]], [-n[0, 1], n[0, 0]]]) @ g[:2] / determinant
    if not (np.abs(x[:2]) < _MAX_STEP_PX).all():
        return None
    for k in reversed(told):
        x[k] = (g[k] - n[k, :k] @ x[:k]) / n[k, k]
    return x, (n[1, 1] / determinant, -n[0, 1] / determinant, n[0, 0] / determinant)
