"""What the publication states of its simulation, and what had to be assumed."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import SeparationOrder, TargetLooks
from groundstation.relative_navigation.rotations import turn

Floats = NDArray[np.float64]

SEMI_MAJOR_AXIS_M, ECCENTRICITY = 6878.5e3, 0.0011831
"""Of the published elements."""
MEAN_ANOMALY_RAD = math.radians(111.9298)
"""Likewise."""
TRUE_ANOMALY_RAD = MEAN_ANOMALY_RAD + 2.0 * ECCENTRICITY * math.sin(MEAN_ANOMALY_RAD)
"""To the first power of the eccentricity: within 2e-6 rad."""
RATE_RAD_S = 1.106819e-3
"""Of the orbit, by the published mean motion."""
INERTIA_KG_M2 = np.array((1.60, 1.16, 1.86))
START_M, SPEED_M_S = 3.0, 0.01
"""Published r0 and v0 along the vertical."""
RATE_BODY_RAD_S = np.array((0.0, 0.01, 0.0))
TIPS_M = np.array(
    [
        [0.16, 0.02, 0.08],
        [-0.17, 0.04, 0.07],
        [0.03, 0.16, 0.09],
        [-0.04, -0.17, 0.06],
        [0.06, 0.05, -0.12],
        [-0.05, -0.07, -0.10],
    ]
)
"""Six tips, no two turns of the body alike."""
TIP_M = 0.016
F_PX, SIZE_PX = 750.0, (640, 480)
TILT_RAD = np.radians(16.0)
"""Of the camera from the vertical, backwards: the craft wanders there."""
STEP_S, END_S = 4.0, 920.0
ASSUMED = (
    "camera of 640 x 480 pixels, f = 750 px, its axis 16 deg backwards of the vertical, where the "
    "microsatellite wanders",
    "six antenna tips that span 0.34 m, bright disks of 16 mm on a dark sky (200 of 255 steps, noise 4); no "
    "tip hides another; the size was chosen such that the published methods lose them near 15 m",
    "a picture every 4 s; the first attitude; the first guess 0.05 rad and 2 % off",
    "the published threshold at 0.4 of the brightest, eps of 12 px, Newton's eps0; rates by differences of "
    "the last two poses",
    "truth: both craft about a point mass on the orbit of the published elements (e = 0.0012), Euler's "
    "equations with gravity gradient, integrated",
)


def camera_axes(tilt_rad: float) -> Floats:
    """Return ``camera_from_orbital`` of a camera that looks up, tilted backwards; its y: minus the normal."""
    forward = np.array((np.cos(tilt_rad), -np.sin(tilt_rad), 0.0))
    down = np.array((0.0, 0.0, -1.0))
    return np.stack((np.cross(down, forward), down, forward))


def simulation(
    step_s: float = STEP_S,
    end_s: float = END_S,
    *,
    tip_m: float = TIP_M,
    f_px: float = F_PX,
    size_px: tuple[int, int] = SIZE_PX,
    seed: int = 1,
) -> SeparationOrder:
    """Return the order of the published simulation."""
    return SeparationOrder(
        np.arange(0.0, end_s + 0.5 * step_s, step_s),
        SEMI_MAJOR_AXIS_M,
        np.array((START_M, 0.0, 0.0)),
        np.array((SPEED_M_S, 0.0, 0.0)),
        INERTIA_KG_M2,
        turn(np.array((0.3, 0.2, 0.1))),
        RATE_BODY_RAD_S,
        camera_axes(TILT_RAD),
        f_px,
        TIPS_M,
        ECCENTRICITY,
        TRUE_ANOMALY_RAD,
        size_px=size_px,
        looks=TargetLooks(tip_diameter_m=tip_m),
        seed=seed,
    )
