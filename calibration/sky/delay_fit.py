"""Delay of the camera against the IMU: where integrated turn rate and star headings agree best.

A heading that arrived at ``t`` was true at ``t - delay``. With G the integral of the gyro's rate the
model is ``heading = scale G(t - delay) + offset + bias t``; delay, offset, bias and scale of the gyro are
least squares. Without the scale a turn that begins and ends would read a wrong scale as a delay.
The turn has to change for the delay to be seen at all.

A robust fit finds the delay roughly and leaves wrong headings out. Then noise of the headings, jitter of
the pictures and random walk of the integrated gyro are told apart (``delay_noise``), and the final fit
weighs by them: without the walk its spread would be several times too small.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError
from calibration.sky.delay_noise import fit_noise, gyro_walk_rad2_s

Array = NDArray[np.float64]

_CLIP_SIGMAS = 4.0
_STEPS = 20
_FINAL_STEPS = 3
_WORST_CONDITION = 1e10
_NO_TURN = 1e-9
_MIN_HEADINGS = 10


@dataclass(frozen=True, slots=True, eq=False)
class CameraDelay:
    """The delay with its spread.

    Attributes:
        delay_s: Arrival minus exposure.
        sigma_s: One sigma of it, the same for all pictures.
        jitter_s: One sigma by which single pictures differ from it; 0 where the residuals show none.
        gyro_bias_rad_s: To subtract from the gyro's rate.
        gyro_scale: Turn by the stars over turn by the gyro.
        residual_rad: Heading minus model, of the used fixes.
        rate_rad_s: Turn rate at these fixes' exposures.
        used: Which headings were not clipped.
    """

    delay_s: float
    sigma_s: float
    jitter_s: float
    gyro_bias_rad_s: float
    gyro_scale: float
    residual_rad: Array
    rate_rad_s: Array
    used: NDArray[np.bool_]


def camera_delay(
    gyro_t_s: Array, rate_rad_s: Array, arrival_t_s: Array, heading_rad: Array, guess_s: float = 0.0
) -> CameraDelay:
    """Estimate the delay.

    Args:
        gyro_t_s: Times of the rate samples, rising, shape (n,).
        rate_rad_s: Turn rates, shape (n,).
        arrival_t_s: When each heading arrived, shape (m,).
        heading_rad: Headings of the stars, any turn, shape (m,).
        guess_s: First guess of the delay.

    Raises:
        CalibrationRefusedError: The times do not rise, too few headings lie inside the gyro's, or the
            turn rate changes too little to see a delay.
    """
    if len(gyro_t_s) < 2 or (np.diff(gyro_t_s) <= 0.0).any():
        raise CalibrationRefusedError("the gyro's times must rise")
    # A sample is the mean over the window that ends at its time: the angle there is the sum.
    angle = np.concatenate(([0.0], np.cumsum(rate_rad_s[1:] * np.diff(gyro_t_s))))
    delay, middle = guess_s, float(gyro_t_s.mean())
    inside = (arrival_t_s - guess_s > gyro_t_s[0] + 1.0) & (arrival_t_s - guess_s < gyro_t_s[-1] - 1.0)
    if int(inside.sum()) < _MIN_HEADINGS:
        raise CalibrationRefusedError(
            f"{int(inside.sum())} headings lie inside the gyro's times, 10 are needed"
        )
    times, heading = arrival_t_s[inside], heading_rad[inside]
    offset = bias = 0.0
    scale = 1.0
    used = np.ones(len(times), dtype=bool)
    residual, variance = np.zeros(len(times)), np.ones(len(times))
    normal = np.eye(4)
    for step in range(_STEPS):
        turned = np.interp(times - delay, gyro_t_s, angle)
        model = scale * turned + offset + bias * (times - middle)
        residual = np.angle(np.exp(1j * (heading - model)))
        if step == 0:  # the offset may be anything: turn the residuals to their common direction
            offset = float(np.angle(np.exp(1j * residual).sum()))
            continue
        rate = np.interp(times - delay, gyro_t_s, rate_rad_s)
        design = np.stack((-scale * rate, np.ones_like(rate), times - middle, turned - turned.mean()), axis=1)
        variance = _variance(residual, rate)
        used = residual**2 <= np.maximum(_CLIP_SIGMAS**2 * variance, 1e-18)
        weighted = design[used] / variance[used, None]
        normal = design[used].T @ weighted
        change = _solved(normal, weighted.T @ residual[used])
        delay, bias, scale = delay + change[0], bias + change[2], scale + change[3]
        offset += change[1] - change[3] * turned.mean()
        if abs(change[0]) < 1e-7:
            break
    if int(used.sum()) < _MIN_HEADINGS:
        raise CalibrationRefusedError(
            f"{int(used.sum())} headings fit the gyro's turn, {_MIN_HEADINGS} are needed"
        )
    times, heading = times[used], heading[used]
    noise, normal = None, np.eye(3)
    for _ in range(_FINAL_STEPS):
        turned = np.interp(times - delay, gyro_t_s, angle)
        rate = np.interp(times - delay, gyro_t_s, rate_rad_s)
        model = scale * turned + offset + bias * (times - middle)
        residual = np.angle(np.exp(1j * (heading - model)))
        design = np.stack((-scale * rate, times - middle, turned), axis=1)
        if noise is None:
            noise = fit_noise(times, rate, residual, design, gyro_walk_rad2_s(gyro_t_s, rate_rad_s))
        white, _ = noise.whiten(times, rate, np.column_stack((residual, design)))
        normal = white[:, 1:].T @ white[:, 1:]
        change = _solved(normal, white[:, 1:].T @ white[:, 0])
        delay, bias, scale = delay + change[0], bias + change[1], scale + change[2]
        residual = residual - design @ change
        offset += float(np.mean(residual))
        residual = residual - float(np.mean(residual))
    if abs(scale) < _NO_TURN:
        raise CalibrationRefusedError("the headings do not turn with the gyro: frozen fixes?")
    whole = np.zeros(len(arrival_t_s), dtype=bool)
    whole[np.flatnonzero(inside)[used]] = True
    return CameraDelay(
        delay_s=float(delay),
        sigma_s=float(np.sqrt(np.linalg.inv(normal)[0, 0])),
        jitter_s=0.0 if noise is None else float(np.sqrt(noise.jitter_s2)),
        gyro_bias_rad_s=-float(bias) / scale,
        gyro_scale=float(scale),
        residual_rad=residual,
        rate_rad_s=rate,
        used=whole,
    )


def _solved(normal: Array, right: Array) -> Array:
    """The change of the unknowns.

    Raises:
        CalibrationRefusedError: The turn does not tell them apart.
    """
    size = np.sqrt(np.maximum(np.diag(normal), 0.0))
    if not size.min() > 0.0 or not np.linalg.cond(normal / np.outer(size, size)) < _WORST_CONDITION:
        raise CalibrationRefusedError("the turn rate changes too little to see a delay")
    return np.asarray(np.linalg.solve(normal, right), dtype=np.float64)


def _variance(residual_rad: Array, rate_rad_s: Array) -> Array:
    """Variance of each residual, growing with the turn rate: from the medians of slow and fast ones."""
    order = np.argsort(np.abs(rate_rad_s))
    slow, fast = order[: len(order) // 2], order[-(len(order) // 3) :]
    low, high = (1.4826**2 * float(np.median(residual_rad[rows] ** 2)) for rows in (slow, fast))
    low2, high2 = (float(np.median(rate_rad_s[rows] ** 2)) for rows in (slow, fast))
    slope = max(high - low, 0.0) / max(high2 - low2, 1e-12)
    return np.maximum(low + slope * (rate_rad_s**2 - low2), max(0.25 * low, 1e-18))
