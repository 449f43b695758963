"""A film like the published one, rendered by the emulator, and followed by both sides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import Separation, SeparationOrder, TargetLooks, fly_separation
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.rotations import turn
from groundstation.relative_navigation.spots import SpotFinder, SpotSettings
from groundstation.relative_navigation.tracker_settings import TrackerSettings
from groundstation.studies.chibis.condition import (
    ECCENTRICITY,
    F_PX,
    INERTIA_KG_M2,
    RATE_RAD_S,
    SEMI_MAJOR_AXIS_M,
    SIZE_PX,
    TRUE_ANOMALY_RAD,
)
from groundstation.studies.chibis.simulation import SIDES
from groundstation.studies.following import Course, follow, settings_of, tracker_of
from groundstation.studies.study import DEFAULT, PUBLISHED, Generated, Progress

Floats = NDArray[np.float64]

FRAME_S, GLARE_S, FILM_S = 1.0 / 30.0, 3.0, 3.6
UP_RAD = np.radians(30.0)
START_M = 3.0
VELOCITY_CAMERA_M_S = np.array((0.12, 0.00, 0.27))
RATE_DEG_S, GYRO_DEG_S = np.array((-2.08, -3.01, 2.15)), 4.5
BY_VIDEO_DEG_S = 4.24
GYRO_FROM_S, GYRO_TO_S, GYRO_STEP_S, GYRO_NOISE_DEG_S = 30.0, 60.0, 0.5, 0.03
TIPS_M = np.array([[-0.65, -0.20, 0.02], [0.65, -0.20, 0.02], [-0.12, 0.42, -0.15], [0.15, 0.45, 0.12]])
"""Left and right long antenna, two short ones below."""
LOOKS = TargetLooks(
    tip_diameter_m=0.03,
    body_half_m=np.array((0.13, 0.20, 0.13)),
    antennas=(0, 1),
    dim_antennas=(2, 3),
    glare_from_s=GLARE_S,
)
LEVEL = 0.4
SPOTS = {
    PUBLISHED: SpotSettings(method="contour", level=LEVEL, antennas=(0, 1)),
    DEFAULT: SpotSettings(level=LEVEL, antennas=(0, 1), antenna_rule="own"),
}
GAP = 5
ASSUMED = (
    "camera of 640 x 480 pixels, f = 750 px, looking along the axis of separation; 3 m at the first frame",
    "places of the four tips; long antennas bright all along, short ones at their tips; body at 240 of 255; "
    "from 3 s on the glare of the body grows within 0.25 s until it fills the picture",
    "the published velocity in camera axes (right, down, forward); the published direction of the rate in "
    "body axes, made as fast as the gyro measured; its signs are doubtful",
    "the level of the binary picture 0.4; for both sides",
    "inertia, orbit and place in it those of the simulation; the first guess 0.05 rad and 2 % off",
    "a gyro with 0.03 deg/s of noise, on the same motion 30 s later",
)


@dataclass(frozen=True, slots=True, eq=False)
class Filmed:
    """The film, and what both sides made of it.

    Attributes:
        order: That was flown.
        truth: Of it, frames first, then the moments of the gyro.
        frames: How many are frames.
        courses: Of each side.
        settings: Of the trackers.
        gyro_deg_s: Time, s, and length of the rate, (m, 2).
    """

    order: SeparationOrder
    truth: Separation
    frames: int
    courses: Mapping[str, Course]
    settings: TrackerSettings
    gyro_deg_s: Floats

    def last(self, side: str) -> int:
        """Number of the last solved frame."""
        return self.courses[side].last_solved(GAP) or 0

    def mean_velocity_m_s(self, side: str) -> Floats:
        """Camera axes, (3,), over all solved frames: published by differences, ours by the filter's last."""
        course, last = self.courses[side], self.last(side)
        if side == DEFAULT:
            found = course.velocities_m_s[last]
        else:
            known = course.is_solved & np.isfinite(course.velocities_m_s[:, 0])
            found = course.velocities_m_s[known].mean(axis=0)
        return np.asarray(self.order.camera_from_orbital @ found)

    def rate_deg_s(self, side: str) -> Floats:
        """Body axes, (3,), likewise."""
        course, last = self.courses[side], self.last(side)
        if side == DEFAULT:
            return np.asarray(np.degrees(course.rates_rad_s[last]))
        known = course.is_solved & np.isfinite(course.rates_rad_s[:, 0])
        return np.asarray(np.degrees(course.rates_rad_s[known].mean(axis=0)))


def film_order(step_s: float = FRAME_S) -> tuple[SeparationOrder, int]:
    """Return the order of the film and of the gyro's moments, and how many are frames."""
    frames = np.arange(round(FILM_S / step_s)) * step_s
    gyro = np.arange(GYRO_FROM_S, GYRO_TO_S, GYRO_STEP_S)
    forward = np.array((np.sin(UP_RAD), -np.cos(UP_RAD), 0.0))
    down = np.array((-np.cos(UP_RAD), -np.sin(UP_RAD), 0.0))
    camera = np.stack((np.cross(down, forward), down, forward))
    rate = np.radians(GYRO_DEG_S) * RATE_DEG_S / np.linalg.norm(RATE_DEG_S)
    order = SeparationOrder(
        np.concatenate((frames, gyro)),
        SEMI_MAJOR_AXIS_M,
        START_M * forward,
        camera.T @ VELOCITY_CAMERA_M_S,
        INERTIA_KG_M2,
        turn(np.array((0.10, 0.12, -0.05))),
        rate,
        camera,
        F_PX,
        TIPS_M,
        ECCENTRICITY,
        TRUE_ANOMALY_RAD,
        size_px=SIZE_PX,
        looks=LOOKS,
        seed=2,
    )
    return order, len(frames)


def film(progress: Progress, step_s: float = FRAME_S) -> Filmed:
    """Render the film, and follow it by both sides."""
    order, count = film_order(step_s)
    truth = fly_separation(order)
    settings = settings_of(order, truth, rate_rad_s=RATE_RAD_S)
    finders = {side: SpotFinder(SPOTS[side]) for side in SIDES}
    centres: dict[str, list[Centres]] = {side: [] for side in SIDES}
    for number in range(count):
        progress("rendering the film", number / count)
        picture = truth.picture(number)
        for side in SIDES:
            centres[side].append(finders[side].look(picture).centres)
    shown = _first(truth, count)
    courses = {side: follow(tracker_of(side, settings), shown, centres[side]) for side in SIDES}
    lengths = np.degrees(np.linalg.norm(truth.rates_body_rad_s[count:], axis=1))
    noise = np.random.default_rng(5).normal(0.0, GYRO_NOISE_DEG_S, len(lengths))
    gyro = np.stack((truth.times_s[count:], lengths + noise), axis=1)
    return Filmed(order, truth, count, courses, settings, gyro)


def _first(truth: Separation, count: int) -> Separation:
    return Separation(
        truth.times_s[:count],
        truth.positions_camera_m[:count],
        truth.positions_orbital_m[:count],
        truth.velocities_orbital_m_s[:count],
        truth.camera_from_body[:count],
        truth.rates_body_rad_s[:count],
        truth.pixels[:count],
        truth.picture,
    )


FILM = Generated(film, 1.0)
