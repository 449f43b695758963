"""Figures 2.6 to 2.8, and what becomes of both sides when eps, start, inertia or orbit is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.intensity import published_level
from groundstation.relative_navigation.outlines import blobs_of
from groundstation.studies.chibis.condition import (
    INERTIA_KG_M2,
    RATE_RAD_S,
    SEMI_MAJOR_AXIS_M,
    STEP_S,
    TIPS_M,
)
from groundstation.studies.chibis.simulation import GAP, SIDES, Simulated
from groundstation.studies.following import Course, follow, settings_of, tracker_of
from groundstation.studies.photographs import Photograph, box_around, column, side_by_side
from groundstation.studies.study import DEFAULT, PUBLISHED, Drawn, Number

Floats = NDArray[np.float64]

RIGHT_DEG, RIGHT_SHARE = 15.0, 0.1
"""A solved frame counts as right within these errors, of the turn and as a share of the distance."""
LOST_SHARE = 0.1
"""With fewer frames solved and right a case counts as lost."""
NAN = float("nan")
AFTER_S = 60.0
RATE_SHARE_600_KM = (SEMI_MAJOR_AXIS_M / (SEMI_MAJOR_AXIS_M + 100e3)) ** 1.5
"""Of the rates, at 600 and at 500 km: the publication's text has the one, its elements the other."""
_FRAME = 40


@dataclass(frozen=True, slots=True)
class Case:
    """One thing that is wrong.

    Attributes:
        words: What.
        told: Arguments of `settings_of` that differ.
        drifts: Whether what is propagated after the last frame is looked at, too.
    """

    words: str
    told: Mapping[str, Any]
    drifts: bool = False


CASES = (
    Case("as it should be", {}, drifts=True),
    *(Case(f"eps {eps:g} px", {"reach_px": eps}) for eps in (0.5, 1.0, 2.0, 40.0, 100.0)),
    *(
        Case(f"start {deg:g} deg off", {"guess_off_rad": np.radians(deg)})
        for deg in (10.0, 25.0, 60.0, 120.0)
    ),
    *(
        Case(f"start {100 * share:g} % too far", {"guess_off_share": share, "guess_off_rad": 0.0})
        for share in (0.1, 0.5)
    ),
    Case("inertia, axes x and z exchanged", {"inertia_kg_m2": INERTIA_KG_M2[[2, 1, 0]]}, drifts=True),
    Case("inertia, that of a sphere", {"inertia_kg_m2": np.ones(3)}, drifts=True),
    Case("orbit of 600 km instead of 500", {"rate_rad_s": RATE_RAD_S * RATE_SHARE_600_KM}, drifts=True),
    Case("orbit twice as fast", {"rate_rad_s": 2.0 * RATE_RAD_S}, drifts=True),
)


def run_case(found: Simulated, case: Case, side: str) -> Course:
    """Follow the frames of the simulation once more, with something wrong."""
    told = {"rate_rad_s": RATE_RAD_S} | dict(case.told)
    settings = settings_of(found.order, found.truth, **told)
    return follow(tracker_of(side, settings), found.truth, found.centres[side])


def right_share(found: Simulated, course: Course, side: str) -> float:
    """Share of the frames up to the nominal last one that are solved, and right."""
    last = found.last(side) + 1
    right = (
        course.is_solved & (course.away_deg < RIGHT_DEG) & (course.away_m < RIGHT_SHARE * found.distances_m)
    )
    return float(right[:last].mean())


def wrong_share(found: Simulated, course: Course, side: str) -> float:
    """Share of the frames up to the nominal last one that are called solved, and are wrong."""
    last = found.last(side) + 1
    right = (course.away_deg < RIGHT_DEG) & (course.away_m < RIGHT_SHARE * found.distances_m)
    return float((course.is_solved & ~right)[:last].mean())


def draw_reference_points(data: Mapping[str, Simulated]) -> Drawn:
    """Figures 2.6, 2.7, 2.8, and the stated limits."""
    found = data["simulation"]
    pictures = _pictures(found)
    off_px = _first_off_px(found)
    numbers = [Number("first prediction off the tips, px rms", ours=off_px)]
    lost: dict[str, list[str]] = {side: [] for side in SIDES}
    for case in CASES:
        courses = {side: run_case(found, case, side) for side in SIDES}
        shares = [right_share(found, courses[side], side) for side in SIDES]
        numbers.append(Number.beside(f"{case.words}: frames solved and right", NAN, shares))
        for side, share in zip(SIDES, shares, strict=True):
            if share < LOST_SHARE:
                lost[side].append(case.words)
        wrong = [wrong_share(found, courses[side], side) for side in SIDES]
        if max(wrong) > 0.0:
            numbers.append(Number.beside(f"{case.words}: frames solved and wrong", NAN, wrong))
        if case.drifts:
            numbers += _drift(case, courses)
    words = (
        "The publication names the limits without numbers. An eps that is small beside the error of the "
        f"first prediction, here {off_px:.1f} px rms, takes too few points; a large one does no harm, since "
        "one centre serves one point only, which is not published. Hardly a frame is right with: "
        f"{_named(lost[PUBLISHED])} (published methods); {_named(lost[DEFAULT])} (our defaults, which search "
        f"when they are lost). Between frames {STEP_S:g} s apart a wrong inertia or orbit hardly matters; in "
        "what is propagated afterwards it does, though less than rates by differences of two poses."
    )
    return Drawn(pictures, numbers, words)


def _named(cases: list[str]) -> str:
    return ", ".join(cases) if cases else "none of the cases"


def _first_off_px(found: Simulated) -> float:
    """How far the first guess's tips lie from the true ones, rms."""
    settings = settings_of(found.order, found.truth, rate_rad_s=RATE_RAD_S)
    assert settings.guess is not None
    off = settings.camera.project(settings.guess.points_camera_m(TIPS_M)) - found.truth.pixels[0]
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))


def _drift(case: Case, courses: Mapping[str, Course]) -> list[Number]:
    """Errors of what is propagated, a minute after the last solved frame."""
    metres, degrees = [], []
    for side in SIDES:
        course = courses[side]
        t_s = course.times_s[course.last_solved(GAP) or 0] + AFTER_S
        at = min(int(np.searchsorted(course.times_s, t_s)), len(course.times_s) - 1)
        metres.append(float(course.away_m[at]))
        degrees.append(float(course.away_deg[at]))
    return [
        Number.beside(f"{case.words}: position error 60 s after the tips are lost, m", NAN, metres),
        Number.beside(f"{case.words}: attitude error then, deg", NAN, degrees),
    ]


def _pictures(found: Simulated) -> list[tuple[str, str]]:
    number = min(_FRAME, len(found.truth.times_s) - 1)
    picture = found.truth.picture(number)
    box = box_around(found.truth.pixels[number], 20.0, found.order.size_px)
    plain, bounded, marked = (Photograph(picture, box, column(3)) for _ in range(3))
    bounded.outlines([blob.outline for blob in blobs_of(picture, published_level(picture, 0.4))], "v1")
    course = found.courses[PUBLISHED]
    seen = TIPS_M @ course.camera_from_body[number].T + course.positions_m[number]
    middle = 0.5 * (np.array(found.order.size_px) - 1.0)
    marked.asterisks(found.order.f_px * seen[:, :2] / seen[:, 2:] + middle, "v0")
    words = (
        f"At {found.distances_m[number]:.1f} m, cut out. Figure 2.6: the picture; 2.7: boundaries of all "
        "objects; 2.8: the reference points by the answer, asterisks."
    )
    return [(words, side_by_side((plain, bounded, marked), "tips, their boundaries, asterisks on them"))]
