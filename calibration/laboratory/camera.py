"""The camera, or what stands for it: delay and its scatter, pictures lost, noise of the fixes."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.laboratory.findings import Findings, Found
from calibration.laboratory.recorded_flight import RecordedFlight
from calibration.laboratory.smoothed_motion import SmoothedMotion
from calibration.laboratory.thrust_course import POLL_S
from calibration.outcome import CalibrationRefusedError
from calibration.sky.delay import delay_from_headings
from groundstation.cli.progress import Progress

Array = NDArray[np.float64]

FEWEST = 20
MOST_SCATTER = 0.15
"""Of a period: arrivals that scatter more follow no clock."""
LEAST_FREE = 0.3
"""Share of a residual's variance that must not be the smoother's own."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Exposures by the camera's own clock, as arrivals show it.

    Attributes:
        period_s: Between exposures.
        period_sigma_s: Of it.
        scatter_s: Of single arrivals.
        arrivals: How many there were.
        exposures: How many there must have been.
    """

    period_s: float
    period_sigma_s: float
    scatter_s: float
    arrivals: int
    exposures: int


def grid_of(arrival_s: Array) -> Grid | str:
    """Lay arrivals (m,) on an even grid; what speaks against it where there is none."""
    if len(arrival_s) < FEWEST:
        return f"{len(arrival_s)} pictures arrived, {FEWEST} are needed"
    steps = np.diff(arrival_s)
    period = float(np.median(steps))
    # of two arrivals without a loss between them
    single = steps[np.abs(steps - period) < 0.5 * period]
    period = float(single.mean())
    number = np.concatenate([[0.0], np.cumsum(np.rint(steps / period))])
    for _ in range(3):
        slope, offset = np.polyfit(number, arrival_s - arrival_s[0], 1)
        number = np.rint((arrival_s - arrival_s[0] - offset) / slope)
    rest = arrival_s - arrival_s[0] - offset - slope * number
    scatter = math.sqrt(float((rest**2).sum()) / (len(rest) - 2))
    if not slope > 0.0 or scatter > MOST_SCATTER * slope or (np.diff(number) < 1.0).any():
        return "pictures do not arrive by an even clock"
    spread = math.sqrt(float(((number - number.mean()) ** 2).sum()))
    return Grid(float(slope), scatter / spread, scatter, len(arrival_s), int(number[-1] - number[0]) + 1)


def scatter_of(flight: RecordedFlight) -> float:
    """Return by how much exposures scatter about their stamps, s; 0 where no even clock shows it."""
    grid = grid_of(np.asarray(flight.arrival_ns * 1e-9, dtype=np.float64))
    return 0.0 if isinstance(grid, str) else grid.scatter_s


def camera_of(
    flight: RecordedFlight, motion: SmoothedMotion, rate_rad_s: Array, guess_s: float, progress: Progress
) -> Findings:
    """Estimate the camera.

    Args:
        flight: The flight.
        motion: It, smoothed.
        rate_rad_s: (n,) turn rates of its packets without what rounding adds.
        guess_s: Of the delay.
        progress: Called with what is being done, and the share that is done.
    """
    found: dict[str, Found] = {}
    unseen: dict[str, str] = {}
    grid = grid_of(np.asarray(flight.arrival_ns * 1e-9, dtype=np.float64))
    if isinstance(grid, str):
        unseen |= dict.fromkeys(("camera.rate_hz", "camera.delay_jitter_s", "camera.missing_fraction"), grid)
        jitter_s = 0.0
    else:
        jitter_s = grid.scatter_s
        rate = 1.0 / grid.period_s
        found["camera.rate_hz"] = Found(rate, rate**2 * grid.period_sigma_s, "1/s")
        sigma = jitter_s / math.sqrt(2.0 * (grid.arrivals - 2))
        found["camera.delay_jitter_s"] = Found(jitter_s, sigma, "s", "arrivals about an even clock")
        lost, of = grid.exposures - len(flight.fix_arrival_ns), grid.exposures
        share = (lost + 0.5) / (of + 1.0)
        found["camera.missing_fraction"] = Found(
            lost / of, math.sqrt(share * (1.0 - share) / of), "1", f"{lost} of {of} exposures gave no fix"
        )
    try:
        # a poll is of a moment, so that the sum of polls is the angle half a poll later
        outcome = delay_from_headings(
            flight.stamp_ns * 1e-9 + 0.5 * POLL_S,
            rate_rad_s,
            np.asarray(flight.fix_arrival_ns * 1e-9, dtype=np.float64),
            flight.fix_pose[:, 2],
            guess_s=guess_s,
            progress=progress,
        )
        delay = outcome.quantities["delay"]
        found["camera.delay_s"] = Found(delay.value, delay.sigma, "s", "middle of the exposure to arrival")
    except CalibrationRefusedError as error:
        unseen["camera.delay_s"] = str(error)
    for key, columns in (("camera.sigma_xy_m", (0, 1)), ("camera.sigma_heading_rad", (2,))):
        if len(flight.fix_arrival_ns) == 0:
            unseen[key] = "fixes came from another source"
            continue
        noise = _noise(motion, columns, jitter_s)
        if isinstance(noise, str):
            unseen[key] = noise
        else:
            found[key] = Found(*noise, key.rpartition("_")[2])
    return Findings(found, unseen)


def _noise(motion: SmoothedMotion, columns: tuple[int, ...], jitter_s: float) -> tuple[float, float] | str:
    """Noise of fixes and its sigma by what they are off the smoothed motion, which they have a part in."""
    if len(motion.fix_left) < FEWEST:
        return f"{len(motion.fix_left)} fixes were used, {FEWEST} are needed"
    chosen = list(columns)
    left, speed = motion.fix_left[:, chosen], motion.fix_speed[:, chosen]
    free = 1.0 - motion.fix_own_variance[:, chosen] / motion.fix_variance[:, chosen]
    if free.mean() < LEAST_FREE:
        return "the fixes are too rare to be told from the motion between them"
    variance = float((left**2 - (jitter_s * speed) ** 2).sum() / free.sum())
    if not variance > 0.0:
        return "the fixes scatter by less than the moments of their exposures explain"
    value = math.sqrt(variance)
    moved = 1.0 + float(((jitter_s * speed) ** 2).mean()) / variance
    return value, value * moved / math.sqrt(2.0 * float(free.sum()))
