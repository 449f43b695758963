"""The camera's delay against the IMU: where turn rates and star headings agree best."""

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from calibration.imu.channels import complaint_about
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Quantity
from calibration.sky.delay_fit import CameraDelay, camera_delay
from calibration.sky.figures import draw_delay
from groundstation.cli.progress import Progress, silent

Array = NDArray[np.float64]

_SEARCH_S = 0.1
_SEARCHED = (0.0, 1.0, -1.0, 2.0, -2.0, 4.0, 6.0, 8.0)  # a guess must lie within a fraction of a swing


STAMPS_SIGMA_S = 0.5e-3
"""What the stamps of the IMU's windows and of pictures leave open together: in 28 flights of the emulator the
delay came out 0.4 ms too long on average, far more than the scatter of headings explains."""
_LARGEST_S = 3.0
_LEAST_SHARE = 0.5
_LARGEST_SCALE = 0.1
_LARGEST_SHARE_UNKNOWN = 0.25
_WELL_KNOWN_S = 0.01
_LARGEST_RESIDUAL_RAD = 0.1
_LEAST_DIFFERENT = 0.7
_EARLY_SIGMAS = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class _Turns:
    """What is compared; see ``delay_from_headings``."""

    gyro_t_s: Array
    rate_rad_s: Array
    arrival_t_s: Array
    heading_rad: Array

    def search(self, guess_s: float, progress: Progress) -> CameraDelay:
        """Return the best delay near a guess, whether it is credible or not.

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
                found = self._fit(guess)
            except CalibrationRefusedError as error:
                refusal = refusal or str(error)
                continue
            cost = (-int(found.used.sum()), float((found.residual_rad**2).mean()))
            if best is None or cost < best[0]:
                best = cost, found
        if best is None:
            raise CalibrationRefusedError(refusal)
        # A guess far off leaves out headings at the ends that the delay found can use: once more from there.
        return self._fit(best[1].delay_s)

    def _fit(self, guess_s: float) -> CameraDelay:
        return camera_delay(self.gyro_t_s, self.rate_rad_s, self.arrival_t_s, self.heading_rad, guess_s)

    def share_used(self, found: CameraDelay) -> float:
        """Return how many of the headings that the gyro covers the delay explains."""
        at = self.arrival_t_s - found.delay_s
        covered = (at > self.gyro_t_s[0] + 1.0) & (at < self.gyro_t_s[-1] - 1.0)
        return min(1.0, float(found.used.sum()) / max(1, int(covered.sum())))

    def is_credible(self, found: CameraDelay) -> bool:
        """Return whether nothing speaks against a delay that was found."""
        return (
            self.share_used(found) >= _LEAST_SHARE
            and abs(found.gyro_scale - 1.0) <= _LARGEST_SCALE
            and _rms(found) <= _LARGEST_RESIDUAL_RAD
            and abs(found.delay_s) <= _LARGEST_S
            and found.sigma_s <= max(_LARGEST_SHARE_UNKNOWN * abs(found.delay_s), _WELL_KNOWN_S)
        )

    def doubt(self, found: CameraDelay, guess_s: float) -> str:
        """Return why a delay that is not credible is none, with the likely cause."""
        return (
            f"the headings do not follow the gyro at any delay: {self._cause(guess_s)} (best "
            f"{1e3 * found.delay_s:.0f} ms ± {1e3 * found.sigma_s:.0f}, turn by the stars "
            f"{found.gyro_scale:.3g} times the gyro's, {100 * self.share_used(found):.0f} % of the headings "
            f"within {math.degrees(_rms(found)):.2g} deg)"
        )

    def _cause(self, guess_s: float) -> str:
        if len(np.unique(self.heading_rad)) < _LEAST_DIFFERENT * len(self.heading_rad):
            return "many headings are the same: frozen fixes"
        guesses = (
            (self.rate_rad_s, -self.heading_rad, "they run against it: the sign of one of them is wrong"),
            (self.rate_rad_s, np.radians(self.heading_rad), "the headings seem to be degrees"),
            (np.radians(self.rate_rad_s), self.heading_rad, "the gyro's rate seems to be in deg/s"),
        )
        for rate_rad_s, heading_rad, words in guesses:
            other = replace(self, rate_rad_s=rate_rad_s, heading_rad=heading_rad)
            try:
                if other.is_credible(other.search(guess_s, silent)):
                    return words
            except CalibrationRefusedError:
                continue
        return "headings of another vehicle, clocks that are not one, or a turn that changes too little"


def _rms(found: CameraDelay) -> float:
    return float(np.sqrt((found.residual_rad**2).mean()))


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
        CalibrationRefusedError: Too few headings, a turn that changes too little, or headings that do not
            follow the gyro.
    """
    complaint = complaint_about(rate_rad_s)
    if complaint is not None:
        raise CalibrationRefusedError(f"omega {complaint}")
    turns = _Turns(gyro_t_s, rate_rad_s, arrival_t_s, heading_rad)
    found = turns.search(guess_s, progress)
    if not turns.is_credible(found):
        raise CalibrationRefusedError(turns.doubt(found, guess_s))
    rms = _rms(found)
    sigma_s = math.hypot(found.sigma_s, STAMPS_SIGMA_S)
    if found.delay_s < -_EARLY_SIGMAS * sigma_s:
        raise CalibrationRefusedError(
            f"headings agree best with the gyro {-1e3 * found.delay_s:.0f} ms later, but no picture arrives "
            "before it is taken: t_arrival_s is of another clock, or the turn repeats itself"
        )
    return Outcome(
        title="Camera delay against the IMU",
        summary=(
            f"delay {1e3 * found.delay_s:.2f} ms, one sigma {1e3 * sigma_s:.2f} ms, "
            f"jitter {1e3 * found.jitter_s:.2f} ms."
        ),
        quantities={
            "delay": Quantity(found.delay_s, sigma_s, "s"),
            "jitter": Quantity(found.jitter_s, math.nan, "s"),
            "gyro_bias": Quantity(found.gyro_bias_rad_s, math.nan, "rad/s"),
            "gyro_scale": Quantity(found.gyro_scale, math.nan, "1"),
        },
        residual={"heading_rms": Quantity(rms, math.nan, "rad")},
        notes={"headings": int(found.used.sum()), "clipped": int((~found.used).sum())},
        draw=partial(
            draw_delay, arrival_t_s[found.used], found.residual_rad, found.rate_rad_s, found.delay_s
        ),
    )
