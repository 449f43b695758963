"""Sub-pixel centres of spots from their pixels; ``core/spot_fit.c`` has the same formulas."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from oracles.robust import middle_value

Vector = NDArray[np.float64]

_STEPS = 2
_LINE_PX = 3.0  # half length from where a streak is a line and no longer an oval
_ROOT_2PI = float(np.sqrt(2.0 * np.pi))
_MAX_STEP_PX = 2.0
_OUTLIER_SIGMAS = 5.0
_MISFIT_RATIO = 0.3  # the true image is no Gaussian: so much of the model is no outlier
_STREAK_RATIO2 = 2.0  # long over short axis, squared, from where a spot counts as a streak
_MAX_FIT_PX = 2000  # what covers more is a lamp or a window, no star: its moments do
_TRUNCATION = 1.12  # second moments over a finite footprint come out this much too small
_WIDTH2_LIMITS_PX2 = (0.3, 16.0)


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
    """Fit every spot's centre and light, all spots at once.

    Moments give the first guess and the shape: one width for the picture, and a streak for every spot
    whose second moments say so. Then Gauss-Newton steps fit a Gaussian of that shape to the pixels,
    weighted by read and shot noise, saturated pixels and outliers left out.
    """
    guess = _moments(pixels)
    shape = _shapes(guess)
    u, v, flux, covariance, trusted = _gauss_newton(pixels, guess, shape)
    half = 0.5 * (shape[0] + shape[2])
    spread = np.hypot(0.5 * (shape[0] - shape[2]), shape[1])
    return FittedSpots(
        u_px=np.where(trusted, u, guess.u_px),
        v_px=np.where(trusted, v, guess.v_px),
        flux_dn=np.where(trusted, flux, guess.flux_dn),
        covariance_px2=np.where(trusted, covariance, guess.covariance_px2).T.copy(),
        elongation=np.sqrt((half + spread) / np.maximum(half - spread, 1e-3)),
        streak_px=_streaks(shape),
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


def _shapes(moments: _Moments) -> Vector:
    """Give the Gaussian shape (uu, uv, vv; (3, n)) of every spot: round unless it surely is a streak."""
    uu, uv, vv = moments.spread_px2
    half, spread = 0.5 * (uu + vv), np.hypot(0.5 * (uu - vv), uv)
    width2 = min(max(_TRUNCATION * middle_value(half - spread), _WIDTH2_LIMITS_PX2[0]), _WIDTH2_LIMITS_PX2[1])
    long2 = half + spread
    streaked = long2 > _STREAK_RATIO2 * np.maximum(half - spread, width2 / _TRUNCATION)
    # The part of the spread beyond the round image is the streak's, along its own direction.
    extra = np.where(streaked, np.maximum(long2 - width2, 0.0), 0.0)
    angle2 = np.arctan2(2.0 * uv, uu - vv)
    cosine2, sine2 = np.cos(angle2), np.sin(angle2)
    return np.stack(
        (
            width2 + 0.5 * extra * (1.0 + cosine2),
            0.5 * extra * sine2,
            width2 + 0.5 * extra * (1.0 - cosine2),
        )
    )


def _streaks(shape: Vector) -> Vector:
    """Give the streak (du, dv) of every spot, (n, 2): a uniform line of length l spreads l^2 / 12."""
    uu, uv, vv = shape
    length = np.sqrt(12.0 * 2.0 * np.hypot(0.5 * (uu - vv), uv))
    angle = 0.5 * np.arctan2(2.0 * uv, uu - vv)
    return np.stack((length * np.cos(angle), length * np.sin(angle)), axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class _Line:
    """Images of long streaks: a line of light blurred by the round image of a star.

    Attributes:
        cosine: Direction, shape (n,).
        sine: Direction, shape (n,).
        half_px: Half length; zero for what is no long streak, shape (n,).
        width_px: One sigma of the round image, shape (n,).
    """

    cosine: Vector
    sine: Vector
    half_px: Vector
    width_px: Vector

    @classmethod
    def of(cls, streak_px: Vector, shape: Vector) -> "_Line":
        length = np.hypot(streak_px[:, 0], streak_px[:, 1])
        safe = np.maximum(length, 1e-9)
        half, spread = 0.5 * (shape[0] + shape[2]), np.hypot(0.5 * (shape[0] - shape[2]), shape[1])
        width = np.sqrt(np.maximum(half - spread, _WIDTH2_LIMITS_PX2[0]))
        return cls(streak_px[:, 0] / safe, streak_px[:, 1] / safe, 0.5 * length, width)

    def put(
        self, owner: NDArray[np.int64], du: Vector, dv: Vector, unit: Vector, d_u: Vector, d_v: Vector
    ) -> None:
        """Write the image and its derivatives by the centre over those of Gaussians, in place."""
        pixel = np.flatnonzero((self.half_px > _LINE_PX)[owner])
        own = owner[pixel]
        c, s, half, width = self.cosine[own], self.sine[own], self.half_px[own], self.width_px[own]
        along = du[pixel] * c + dv[pixel] * s
        across = (dv[pixel] * c - du[pixel] * s) / width
        front, back = (along + half) / width, (along - half) / width
        profile = (ndtr(front) - ndtr(back)) / (2.0 * half)
        slope = (np.exp(-0.5 * back * back) - np.exp(-0.5 * front * front)) / (2.0 * half * width * _ROOT_2PI)
        side = np.exp(-0.5 * across * across) / (width * _ROOT_2PI)
        by_along, by_across = slope * side, profile * side * across / width
        unit[pixel] = profile * side
        d_u[pixel] = by_along * c - by_across * s
        d_v[pixel] = by_along * s + by_across * c


def _gauss_newton(
    pixels: SpotPixels, guess: _Moments, shape: Vector
) -> tuple[Vector, Vector, Vector, Vector, NDArray[np.bool_]]:
    """Fit centre and light with the shapes held; give also covariance (3, n) and whether to trust it."""
    starts, owner = pixels.starts, pixels.owner
    determinant = shape[0] * shape[2] - shape[1] ** 2
    a, b, c = (
        (shape[2] / determinant)[owner],
        (-shape[1] / determinant)[owner],
        (shape[0] / determinant)[owner],
    )
    norm = 1.0 / (2.0 * np.pi * np.sqrt(determinant))
    streak = _streaks(shape)
    line = _Line.of(streak, shape)
    is_line = bool((line.half_px > _LINE_PX).any())
    u, v, flux = guess.u_px.copy(), guess.v_px.copy(), guess.flux_dn.copy()
    usable = ~pixels.is_saturated
    covariance = guess.covariance_px2
    trusted = pixels.size <= _MAX_FIT_PX
    for step in range(_STEPS):
        du, dv = pixels.u_px - u[owner], pixels.v_px - v[owner]
        along_u, along_v = a * du + b * dv, b * du + c * dv
        unit = norm[owner] * np.exp(-0.5 * (along_u * du + along_v * dv))
        d_unit_u, d_unit_v = unit * along_u, unit * along_v
        if is_line:
            line.put(owner, du, dv, unit, d_unit_u, d_unit_v)
        model = flux[owner] * unit
        error = pixels.light_dn - model
        variance = pixels.variance_dn2 + pixels.gain_dn_per_electron * np.maximum(model, 0.0)
        if step == _STEPS - 1:
            usable = usable & (error * error < _OUTLIER_SIGMAS**2 * variance + (_MISFIT_RATIO * model) ** 2)
        weight = usable / variance
        d_u, d_v = flux[owner] * d_unit_u, flux[owner] * d_unit_v
        w_u, w_v, w_f = weight * d_u, weight * d_v, weight * unit
        products = np.stack(
            (
                *(w_u * d_u, w_u * d_v, w_v * d_v),
                *(w_u * unit, w_v * unit, w_f * unit),
                *(w_u * error, w_v * error, w_f * error),
            )
        )
        n_uu, n_uv, n_vv, n_uf, n_vf, n_ff, g_u, g_v, g_f = np.add.reduceat(products, starts, axis=1)
        # Eliminate the light, then solve the 2x2 system of the centre.
        n_ff = np.maximum(n_ff, 1e-300)
        n_uu, n_uv, n_vv = n_uu - n_uf * n_uf / n_ff, n_uv - n_uf * n_vf / n_ff, n_vv - n_vf * n_vf / n_ff
        h_u, h_v = g_u - n_uf * g_f / n_ff, g_v - n_vf * g_f / n_ff
        det = n_uu * n_vv - n_uv * n_uv
        trusted &= (det > 0.0) & (n_uu > 0.0)
        det = np.where(trusted, det, 1.0)
        step_u, step_v = (n_vv * h_u - n_uv * h_v) / det, (n_uu * h_v - n_uv * h_u) / det
        trusted &= (np.abs(step_u) < _MAX_STEP_PX) & (np.abs(step_v) < _MAX_STEP_PX)
        step_u, step_v = np.where(trusted, step_u, 0.0), np.where(trusted, step_v, 0.0)
        u, v = u + step_u, v + step_v
        flux = flux + np.where(trusted, (g_f - n_uf * step_u - n_vf * step_v) / n_ff, 0.0)
        covariance = np.stack((n_vv, -n_uv, n_uu)) / det
    trusted &= flux > 0.0
    return u, v, flux, covariance, trusted
