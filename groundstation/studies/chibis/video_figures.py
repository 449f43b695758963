"""Figures 3.3 to 3.7: frames of the film, and the motion that it shows."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.intensity import published_level
from groundstation.relative_navigation.outlines import blobs_of
from groundstation.relative_navigation.rotations import rotation_vectors
from groundstation.studies.chibis.condition import SIZE_PX
from groundstation.studies.chibis.simulation import KINDS, SIDES, WORDS
from groundstation.studies.chibis.video import (
    BY_VIDEO_DEG_S,
    FRAME_S,
    GLARE_S,
    GYRO_DEG_S,
    GYRO_TO_S,
    LEVEL,
    TIPS_M,
    VELOCITY_CAMERA_M_S,
    Filmed,
)
from groundstation.studies.photographs import Photograph, column, side_by_side
from groundstation.studies.plots import Axes, Line, over_time
from groundstation.studies.study import PUBLISHED, Drawn, Number

Floats = NDArray[np.float64]

GLARE_SHOWN_S = 3.1


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
    glare = found.truth.picture(int(np.searchsorted(found.truth.times_s[: found.frames], GLARE_SHOWN_S)))
    box = (0, 0, *SIZE_PX)
    plain, halves = Photograph(picture, box, column(2)), Photograph(binary, box, column(2))
    halves.outlines([blob.outline for blob in blobs_of(picture, published_level(picture, LEVEL))], "v1")
    marked, blinded = Photograph(first, box, column(2)), Photograph(glare, box, column(2))
    marked.asterisks(start, "v1")
    marked.crosses(here, "v0")
    pictures = [
        (
            f"At {number * FRAME_S:.1f} s. Figure 3.3: a frame; 3.4: the binary picture and its boundaries.",
            side_by_side((plain, halves), "a frame, and the binary one"),
        ),
        (
            "Figure 3.5: asterisks: the first guess; crosses: estimate by Newton's method. Right: at "
            f"{GLARE_SHOWN_S:g} s the glare of the body hides the tips.",
            side_by_side((marked, blinded), "guess and estimate; glare"),
        ),
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
    off_length = [100.0 * abs(each / float(np.linalg.norm(exact_w)) - 1.0) for each in lengths]
    gyro = float(found.gyro_deg_s[:, 1].mean())
    numbers = [
        Number.beside(
            "frames processed",
            100.0,
            [float(found.courses[side].is_solved.sum()) for side in SIDES],
            "published as about 100; 3 s of 30 frames are 90, and the glare was put there",
            is_put_in=True,
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
            "the true one was chosen as the gyro's 4.5",
            is_put_in=True,
        ),
        Number.beside(
            "rate off the truth, deg/s",
            float("nan"),
            [float(np.linalg.norm(each - exact_w)) for each in rate],
        ),
        Number.beside(
            "length of the rate off the true one, per cent",
            float("nan"),
            off_length,
            "at the first frame",
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
            "published 4.24 against 4.5, 30 s later; what the rate changes meanwhile is in it",
        ),
    ]
    words = (
        f"Three seconds give the length of the rate within {off_length[0]:.1f} per cent by the published "
        "methods, since its mean is the whole turn over the whole time; from frame to frame differences are "
        f"of no use. The published {GYRO_DEG_S - BY_VIDEO_DEG_S:.2f} deg/s between video and gyro is of the "
        "size that this method's error and the change of a free body's rate have here."
    )
    return Drawn(pictures, numbers, words)


def _courses(found: Filmed) -> list[tuple[str, str]]:
    truth, count = found.truth, found.frames
    t_s = truth.times_s[:count]
    turned = np.degrees(rotation_vectors(truth.camera_from_body[:count]))
    places = truth.positions_camera_m[:count]
    pictures = []
    for title, exact, answered in (
        (
            "Figure 3.6: position in camera axes, m",
            places,
            {side: found.courses[side].positions_m for side in SIDES},
        ),
        (
            "Figure 3.7: rotation vector, deg",
            turned,
            {side: found.courses[side].turned_deg for side in SIDES},
        ),
    ):
        panels = []
        for row, name in enumerate("XYZ"):
            lines = [Line("truth", "v2 thick", t_s, exact[:, row])]
            for side in SIDES:
                last = found.last(side) + 1
                lines.append(Line(WORDS[side], KINDS[side], t_s[:last], answered[side][:last, row]))
            panels.append(Axes(name, lines))
        pictures.append((f"{title}.", over_time(panels, 0.0, float(t_s[-1]), title, (GLARE_S,))))
    return pictures


def _gyro(found: Filmed) -> str:
    lines = [Line("gyro", "v2", found.gyro_deg_s[:, 0], found.gyro_deg_s[:, 1], is_dots=True)]
    for side in SIDES:
        length = float(np.linalg.norm(found.rate_deg_s(side)))
        span = np.array((0.0, float(found.truth.times_s[found.last(side)])))
        lines.append(Line(WORDS[side], f"{KINDS[side]} thick", span, np.full(2, length)))
    return over_time([Axes("rate, deg/s", lines, (3.8, 5.2))], 0.0, GYRO_TO_S, "length of the rate")
