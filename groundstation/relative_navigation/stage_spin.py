"""Rates of a stage in regular precession from a few frames of its markers.

Simakov, Ustyugov 2016, experiment 1: a camera leaves along the stage's axis and looks back at it. Unknown are
the attitude at time 0 and the rate; the precession between frames is the closed form, places are known.
All frames of a run are fitted together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from groundstation.relative_navigation.precession import AxialInertia, precess
from groundstation.relative_navigation.rotations import turn

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST_ITERATIONS = 60
REST = 1e-8
_STEPS = np.array((1e-6, 1e-6, 1e-6, 1e-7, 1e-7, 1e-7))
"""For differences: turn rad, rate rad/s."""
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e12
MOST_F_PX, FARTHEST_M, FASTEST_M_S = 1e6, 1e5, 1e4
"""Of a camera that leaves."""
WORST_MISFIT = 9.0
"""Mean square of the residuals over their sigmas, beyond which the pixels are none of the stage."""
BY_CHANCE = 1e-4
"""How seldom noise alone misfits by so much that the covariance is widened."""
NO_REST = "the search did not come to rest, or too little is seen of the turn"


@dataclass(frozen=True, slots=True, eq=False)
class LeavingCamera:
    """A camera that leaves along the inertial x axis and looks back: u = f y / d, v = f z / d, d = place - x.

    Attributes:
        f_px: Focal length.
        start_m: Place on the axis at time 0.
        speed_m_s: Of leaving.

    Raises:
        ValueError: A number that no such camera has.
    """

    f_px: float
    start_m: float
    speed_m_s: float

    def __post_init__(self) -> None:
        for name, value, most in (
            ("f_px", self.f_px, MOST_F_PX), ("camera_start_m", self.start_m, FARTHEST_M),
        ):  # fmt: skip
            if not 0.0 < value <= most:
                raise ValueError(f"{name} is {value:g}, expected above 0 and at most {most:g}")
        if not abs(self.speed_m_s) <= FASTEST_M_S:
            raise ValueError(f"camera_speed_m_s is {self.speed_m_s:g}, expected at most {FASTEST_M_S:g}")

    def project(self, points_m: Floats, times_s: Floats) -> Floats:
        """Return pixels (n, 2) of points (n, 3), inertial axes, each at its own time (n,)."""
        depth = self.start_m + self.speed_m_s * times_s - points_m[:, 0]
        found: Floats = self.f_px * points_m[:, 1:] / depth[:, None]
        return found


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """What is known of the stage.

    Attributes:
        inertia: Its moments.
        markers_m: Body axes, x along the stage, (m, 3).
        camera: What sees it.
    """

    inertia: AxialInertia
    markers_m: Floats
    camera: LeavingCamera


@dataclass(frozen=True, slots=True, eq=False)
class StageRun:
    """Pixels of one run, a row for each marker and frame.

    Attributes:
        times_s: (n,).
        marker: (n,).
        pixels: (n, 2).
    """

    times_s: Floats
    marker: Ints
    pixels: Floats


@dataclass(frozen=True, slots=True, eq=False)
class StageFit:
    """What a run says.

    Attributes:
        rate_rad_s: At time 0, body axes, (3,).
        start: Inertial from body at time 0, (3, 3).
        covariance: Of turn (inertial axes, rad) and rate, (6, 6); NaN where the run does not tell.
        rms_px: Root of the mean squared residual.
        converged: Whether it came to rest, is known, and the pixels are those of the stage.
        reason: Why not, or empty.
    """

    rate_rad_s: Floats
    start: Floats
    covariance: Floats
    rms_px: float
    converged: bool
    reason: str = ""


def fit_stage(stage: Stage, run: StageRun, sigma_px: float, start: Floats | None = None) -> StageFit:
    """Return rate and attitude of least squares.

    Args:
        stage: What is known.
        run: What was seen.
        sigma_px: Of the pixels.
        start: Attitude where the search begins, (3, 3); the inertial axes if nothing is given.
    """
    attitude, rate = np.eye(3) if start is None else start, np.zeros(3)
    instants, which = np.unique(run.times_s, return_inverse=True)

    def predict(rotation: Floats, w: Floats) -> Floats:
        turned = precess(rotation, w, stage.inertia, instants)
        points = np.einsum("nij,nj->ni", turned[which], stage.markers_m[run.marker])
        return stage.camera.project(points, run.times_s)

    def miss(rotation: Floats, w: Floats) -> Floats:
        return ((run.pixels - predict(rotation, w)) / sigma_px).ravel()

    off = miss(attitude, rate)
    cost, damping = float(off @ off), 0.0
    normal = np.full((6, 6), np.nan)
    converged = False
    for _ in range(MOST_ITERATIONS):
        columns = []
        for k, size in enumerate(_STEPS):
            step = np.zeros(6)
            step[k] = size
            ends = [predict(turn(s * step[:3]) @ attitude, rate + s * step[3:]) for s in (1.0, -1.0)]
            columns.append(((ends[0] - ends[1]) / (2.0 * size * sigma_px)).ravel())
        rows = np.stack(columns, axis=1)
        normal, gradient = rows.T @ rows, rows.T @ off
        while True:
            damped = normal.copy()
            damped.flat[::7] *= 1.0 + damping
            step = np.linalg.lstsq(damped, gradient, rcond=1e-14)[0]
            tried = turn(step[:3]) @ attitude, rate + step[3:]
            off_tried = miss(*tried)
            cost_tried = float(off_tried @ off_tried)
            if cost_tried <= cost * (1.0 + 1e-12) or damping > MOST_DAMPING:
                break
            damping = max(FIRST_DAMPING, 10.0 * damping)
        converged = float(gradient @ step) < REST * (1.0 + cost)
        (attitude, rate), off, cost = tried, off_tried, cost_tried
        damping = 0.0 if damping <= FIRST_DAMPING else 0.1 * damping
        if converged:
            break
    scale = 1.0 / np.sqrt(np.maximum(normal.flat[::7], 1e-300))
    scaled = normal * scale * scale[:, None]
    known = bool(np.linalg.cond(scaled) < 1e12)
    covariance = np.linalg.inv(scaled) * scale * scale[:, None] if known else np.full((6, 6), np.nan)
    rms = sigma_px * float(np.sqrt(cost / off.size))
    if not (converged and known and np.isfinite(cost)):
        return StageFit(rate, attitude, np.full((6, 6), np.nan), rms, converged=False, reason=NO_REST)
    freedom = off.size - 6
    misfit = cost / max(1, freedom)
    if misfit > WORST_MISFIT:
        words = f"the pixels miss the stage by more than {WORST_MISFIT**0.5:g} sigma_px"
        return StageFit(rate, attitude, np.full((6, 6), np.nan), rms, converged=False, reason=words)
    if freedom > 0 and cost > float(chi2.isf(BY_CHANCE, freedom)):
        covariance = misfit * covariance  # the pixels are worse than their file tells
    return StageFit(rate, attitude, covariance, rms, converged=True)
