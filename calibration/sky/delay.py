"""The camera's delay against the IMU: where turn rates and star headings agree best."""

import math
from functools import partial

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity
from calibration.sky.delay_fit import camera_delay
from calibration.sky.figures import draw_delay
from groundstation.cli.progress import Progress, silent

Array = NDArray[np.float64]

_SEARCH_S = 0.1
_SEARCHED = (0.0, 1.0, -1.0, 2.0, -2.0, 4.0, 6.0, 8.0)  # a guess must lie within a fraction of a swing


def delay_from_headings(
    gyro_t_s: Array,
    rate_rad_s: Array,
    arrival_t_s: Array,
    heading_rad: Array,
    *,
    guess_s: float = 0.05,
    progress: Progress = silent,
) -> Outcome:
    """Calibrate the delay from the middle of the exposure to the picture's arrival.

    The rig reads the result by ``delay_file``; fusion then takes ``delay`` with the root of the summed
    squares of its sigma and the jitter.

    Args:
        gyro_t_s: End of each rate sample's window, rising, shape (n,).
        rate_rad_s: Turn rates, shape (n,).
        arrival_t_s: When each heading's picture arrived, shape (m,), the same clock.
        heading_rad: Headings by the stars, shape (m,).
        guess_s: First guess of the delay; others near it are tried, too.
        progress: Told how it goes.

    Raises:
        CalibrationRefusedError: Too few headings, or a turn that changes too little.
    """
    best, refusal = None, ""
    for number, steps in enumerate(_SEARCHED):
        progress("comparing turns", number / len(_SEARCHED))
        guess = guess_s + steps * _SEARCH_S
        if guess < 0.0:
            continue
        try:
            found = camera_delay(gyro_t_s, rate_rad_s, arrival_t_s, heading_rad, guess)
        except CalibrationRefusedError as error:
            refusal = refusal or str(error)
            continue
        cost = (-int(found.used.sum()), float((found.residual_rad**2).mean()))
        if best is None or cost < best[0]:
            best = cost, found
    if best is None:
        raise CalibrationRefusedError(refusal)
    # A guess far off leaves out headings at the ends that the delay found can use: once more from there.
    found = camera_delay(gyro_t_s, rate_rad_s, arrival_t_s, heading_rad, best[1].delay_s)
    rms = float(np.sqrt((found.residual_rad**2).mean()))
    warnings: tuple[str, ...] = ()
    if found.delay_s < 0.0:
        warnings = (
            "the delay is negative: pictures would arrive before they were taken; are the clocks one?",
        )
    return Outcome(
        title="Camera delay against the IMU",
        summary=(
            f"delay {1e3 * found.delay_s:.2f} ms, one sigma {1e3 * found.sigma_s:.2f} ms, "
            f"jitter {1e3 * found.jitter_s:.2f} ms."
        ),
        quantities={
            "delay": Quantity(found.delay_s, found.sigma_s, "s"),
            "jitter": Quantity(found.jitter_s, math.nan, "s"),
            "gyro_bias": Quantity(found.gyro_bias_rad_s, math.nan, "rad/s"),
            "gyro_scale": Quantity(found.gyro_scale, math.nan, "1"),
        },
        residual={"heading_rms": Quantity(rms, math.nan, "rad")},
        notes={"headings": int(found.used.sum()), "clipped": int((~found.used).sum())},
        draw=partial(
            draw_delay, arrival_t_s[found.used], found.residual_rad, found.rate_rad_s, found.delay_s
        ),
        warnings=warnings,
    )
