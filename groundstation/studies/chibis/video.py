"""The published film, rendered: figures 3.3 to 3.7."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import Separation, SeparationOrder, TargetLooks, fly_separation
from groundstation.relative_navigation.intensity import published_level
from groundstation.relative_navigation.outlines import blobs_of
from groundstation.relative_navigation.rotations import rotation_vectors, turn
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
from groundstation.studies.chibis.simulation import KINDS, SIDES, WORDS
from groundstation.studies.following import Course, follow, settings_of, tracker_of
from groundstation.studies.photographs import asterisks, crosses, outlines, photograph
from groundstation.studies.plots import Axes, Line, over_time
from groundstation.studies.study import DEFAULT, PUBLISHED, Drawn, Generated, Number, Progress

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
            return np.degrees(course.rates_rad_s[last])
        known = course.is_solved & np.isfinite(course.rates_rad_s[:, 0])
        return np.degrees(course.rates_rad_s[known].mean(axis=0))


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
    centres = {side: [] for side in SIDES}
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


def draw_frames(data: Mapping[str, Filmed]) -> Drawn:
    """Figures 3.3, 3.4 and 3.5: a frame, the binary one, prediction and estimate in it."""
    found = data["film"]
    number = found.frames // 3
    picture = found.truth.picture(number)
    binary = np.where(picture >= published_level(picture, LEVEL), 255, 0).astype(np.uint8)
    guess = found.settings.guess
    assert guess is not None
    camera, course = found.settings.camera, found.courses[PUBLISHED]
    start = camera.project(guess.points_camera_m(TIPS_M))
    here = camera.project(TIPS_M @ course.camera_from_body[0].T + course.positions_m[0])
    first = found.truth.picture(0)
    glare = found.truth.picture(found.frames - 1)
    box = (0, 0, *SIZE_PX)
    paths = [blob.outline for blob in blobs_of(picture, published_level(picture, LEVEL))]
    pictures = [
        (f"Figure 3.3: the frame at {number * FRAME_S:.1f} s.", photograph(picture, [], "a frame", box)),
        (
            "Figure 3.4: the binary picture, and its boundaries.",
            photograph(binary, [outlines(paths, "v1")], "binary frame", box),
        ),
        (
            "Figure 3.5: asterisks: the first guess; crosses: estimate by Newton's method.",
            photograph(first, [asterisks(start, "v1"), crosses(here, "v0", 6.0)], "guess and estimate", box),
        ),
        ("The last frame: the glare of the body hides the tips.", photograph(glare, [], "glare", box)),
    ]
    gap = float(np.sqrt(np.mean(np.sum((start - found.truth.pixels[0]) ** 2, axis=1))))
    left = float(np.sqrt(np.mean(np.sum((here - found.truth.pixels[0]) ** 2, axis=1))))
    numbers = [
        Number("first guess off the tips, px rms", ours=gap),
        Number("estimate off the tips, px rms", ours=left, assumed="off where they truly are"),
    ]
    words = (
        "Body and long antennas make one outline, the longest: its ends along image x are two of the "
        "points. The tips of the short antennas are objects of their own once the level is above the light "
        "of the antennas themselves."
    )
    return Drawn(pictures, numbers, words)


def draw_motion(data: Mapping[str, Filmed]) -> Drawn:
    """Figures 3.6 and 3.7: position and turn over the film, velocity and rate beside the gyro."""
    found = data["film"]
    truth, count = found.truth, found.frames
    t_s = truth.times_s[:count]
    pictures = [(caption, picture) for caption, picture in _courses(found)]
    pictures.append(("Length of the rate: by video in 3 s, and by the gyro 30 s later.", _gyro(found)))
    lasts = [found.last(side) for side in SIDES]
    velocity = [found.mean_velocity_m_s(side) for side in SIDES]
    exact_v = found.order.camera_from_orbital @ truth.velocities_orbital_m_s[:count].mean(axis=0)
    rate = [found.rate_deg_s(side) for side in SIDES]
    lengths = [float(np.linalg.norm(each)) for each in rate]
    exact_w = np.degrees(truth.rates_body_rad_s[0])
    gyro = float(found.gyro_deg_s[:, 1].mean())
    numbers = [
        Number.beside(
            "frames processed",
            100.0,
            [float(found.courses[side].is_solved.sum()) for side in SIDES],
            "published as about 100; 3 s of 30 frames are 90",
            1.2,
        ),
        Number.beside(
            "last solved frame, s",
            3.0,
            [float(t_s[last]) for last in lasts],
            "the glare was put there",
            is_put_in=True,
        ),
    ]
    for row, (name, published) in enumerate(
        zip(("right", "down", "forward"), VELOCITY_CAMERA_M_S, strict=True)
    ):
        numbers.append(
            Number.beside(
                f"mean velocity {name}, m/s",
                float(published),
                [float(each[row]) for each in velocity],
                "the motion was chosen to have it",
                is_put_in=True,
            )
        )
    numbers += [
        Number.beside(
            "mean velocity off the truth, m/s",
            float("nan"),
            [float(np.linalg.norm(each - exact_v)) for each in velocity],
        ),
        Number.beside(
            "length of the rate by video, deg/s",
            BY_VIDEO_DEG_S,
            lengths,
            "the true one was chosen as the gyro's 4.5, not as the video's",
            1.1,
        ),
        Number.beside(
            "rate off the truth, deg/s",
            float("nan"),
            [float(np.linalg.norm(each - exact_w)) for each in rate],
        ),
        Number(
            "length of the rate by the gyro, deg/s",
            GYRO_DEG_S,
            gyro,
            assumed="chosen at the first frame; free motion since then",
            is_put_in=True,
        ),
        Number.beside(
            "video off the gyro, per cent",
            100.0 * (GYRO_DEG_S - BY_VIDEO_DEG_S) / GYRO_DEG_S,
            [100.0 * abs(each - gyro) / gyro for each in lengths],
            "published 4.24 against 4.5; what the gyro's 30 s change is in it",
        ),
    ]
    words = (
        "Three seconds are enough for a rate within a few per cent, since its mean is the whole turn over "
        "the whole time; from frame to frame differences are of no use. The published 0.26 deg/s between "
        "video and gyro is no more than this method's own error together with what a free body's rate "
        "changes in 30 s."
    )
    return Drawn(pictures, numbers, words)


def _courses(found: Filmed) -> list[tuple[str, str]]:
    truth, count = found.truth, found.frames
    t_s = truth.times_s[:count]
    turned = np.degrees(rotation_vectors(truth.camera_from_body[:count]))
    places = truth.positions_camera_m[:count]
    pictures = []
    for title, exact, pick in (
        ("Figure 3.6: position in camera axes, m", places, lambda course: course.positions_m),
        ("Figure 3.7: rotation vector, deg", turned, _turned_deg),
    ):
        panels = []
        for row, name in enumerate("XYZ"):
            lines = [Line("truth", "v2 thick", t_s, exact[:, row])]
            for side in SIDES:
                last = found.last(side) + 1
                lines.append(
                    Line(WORDS[side], KINDS[side], t_s[:last], pick(found.courses[side])[:last, row])
                )
            panels.append(Axes(name, lines))
        pictures.append((f"{title}.", over_time(panels, 0.0, float(t_s[-1]), title, (GLARE_S,))))
    return pictures


def _turned_deg(course: Course) -> Floats:
    found = np.full((len(course.times_s), 3), np.nan)
    known = np.isfinite(course.positions_m[:, 0])
    found[known] = np.degrees(rotation_vectors(course.camera_from_body[known]))
    return found


def _gyro(found: Filmed) -> str:
    lines = [Line("gyro", "v2", found.gyro_deg_s[:, 0], found.gyro_deg_s[:, 1], is_dots=True)]
    for side in SIDES:
        length = float(np.linalg.norm(found.rate_deg_s(side)))
        span = np.array((0.0, float(found.truth.times_s[found.last(side)])))
        lines.append(Line(WORDS[side], f"{KINDS[side]} thick", span, np.full(2, length)))
    return over_time([Axes("rate, deg/s", lines, (3.8, 5.2))], 0.0, GYRO_TO_S, "length of the rate")
