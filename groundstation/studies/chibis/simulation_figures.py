"""Figures 2.10 to 2.14: courses and errors of the published simulation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.rotations import rotation_vectors
from groundstation.studies.chibis.simulation import KINDS, SIDES, WORDS, Simulated, tip_px
from groundstation.studies.following import Course
from groundstation.studies.plots import Axes, Line, over_time
from groundstation.studies.study import Drawn, Number

Floats = NDArray[np.float64]

NEAR_M, FAR_M = (0.0, 3.5), (13.5, 15.0)
"""Distances over which errors are taken together."""


def rms(values: Floats) -> float:
    """Root of the mean square; NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")


def _inside(found: Simulated, side: str, span_m: tuple[float, float]) -> NDArray[np.bool_]:
    distances = found.distances_m
    return (distances >= span_m[0]) & (distances <= span_m[1]) & found.courses[side].is_solved


def _later(found: Simulated, side: str, after_s: float) -> int:
    last = found.last(side)
    return min(
        int(np.searchsorted(found.truth.times_s, found.truth.times_s[last] + after_s)),
        len(found.truth.times_s) - 1,
    )


def draw_course(data: Mapping[str, Simulated]) -> Drawn:
    """Figures 2.10 and 2.11: where the microsatellite is, and how it is turned."""
    found = data["simulation"]
    t_s, truth = found.truth.times_s, found.truth
    pictures = []
    for side in SIDES:
        course = found.courses[side]
        panels = []
        for row, (name, unit) in enumerate((("X right", "m"), ("Y down", "m"), ("Z forward", "m"))):
            lines = [
                Line("truth", "v2 thick", t_s, truth.positions_camera_m[:, row]),
                Line(WORDS[side], KINDS[side], t_s, course.positions_m[:, row]),
            ]
            panels.append(Axes(f"{name}, {unit}", lines, _span(truth.positions_camera_m[:, row])))
        exact, answered = np.degrees(rotation_vectors(truth.camera_from_body)), course.turned_deg
        for row, name in enumerate("XYZ"):
            lines = [
                Line("truth", "v2 thick", t_s, exact[:, row]),
                Line(WORDS[side], KINDS[side], t_s, answered[:, row]),
            ]
            panels.append(Axes(f"turn {name}, deg", lines, (-200.0, 200.0)))
        caption = (
            f"{WORDS[side]}: position and rotation vector in camera axes; dashed: the last solved frame."
        )
        marks = (float(t_s[found.last(side)]),)
        pictures.append((caption, over_time(panels, 0.0, float(t_s[-1]), WORDS[side], marks)))
    places = truth.positions_orbital_m
    distances = found.distances_m
    numbers = [
        Number(
            f"distance {metres:g} m is reached at, s",
            ours=float(np.interp(metres, distances, t_s)),
            assumed="by the published start; the publication shows a curve without values",
        )
        for metres in (5.0, 10.0, 15.0)
    ]
    at_end = int(np.argmin(np.abs(distances - 15.0)))
    angle = float(np.degrees(np.arctan2(-places[at_end, 1], places[at_end, 0])))
    numbers.append(
        Number(
            "off the vertical at 15 m, deg",
            ours=angle,
            assumed="a camera that looks straight up needs twice that field",
        )
    )
    words = (
        f"Thrown straight up, the microsatellite falls behind: at 15 m it lies {angle:.0f} degrees off the "
        "vertical. Both sides follow it until its tips are smaller than a pixel; then their equations of "
        "motion go on alone."
    )
    return Drawn(pictures, numbers, words)


def _span(values: Floats) -> tuple[float, float]:
    low, high = float(values.min()), float(values.max())
    room = 0.1 * (high - low) + 0.3
    return low - room, high + room


def draw_errors(data: Mapping[str, Simulated]) -> Drawn:
    """Figures 2.12, 2.13 and 2.14: errors against time, before and after the tips are lost."""
    found = data["simulation"]
    t_s = found.truth.times_s
    lasts = {side: float(t_s[found.last(side)]) for side in SIDES}
    whose = ", ".join(f"{last_s:.0f} s ({WORDS[side]})" for side, last_s in lasts.items())
    pictures = [
        (
            f"Errors against time; dashed: last solved frames, {whose}.",
            _error_picture(found, t_s, "t, s", tuple(lasts.values())),
        ),
        (
            "The same against distance, up to the last solved frame.",
            _error_picture(found, found.distances_m, "distance, m", (3.0, 15.0), until_last=True),
        ),
    ]
    near = [rms(found.courses[side].away_m[_inside(found, side, NEAR_M)]) for side in SIDES]
    far = [rms(found.courses[side].away_m[_inside(found, side, FAR_M)]) for side in SIDES]
    turned = [rms(found.courses[side].away_deg[_inside(found, side, FAR_M)]) for side in SIDES]
    squared = (sum(FAR_M) / (found.distances_m[0] + NEAR_M[1])) ** 2
    stated = "the published camera and tips are not stated, so they are not compared"
    numbers = [
        Number.beside("position error up to 3.5 m, m rms", 0.01, near, f"published at about 3 m; {stated}"),
        Number.beside("position error at 13.5 to 15 m, m rms", 0.4, far, f"published near 15 m; {stated}"),
        Number.beside(
            "attitude error at 13.5 to 15 m, deg rms", 4.0, turned, f"published as a limit; {stated}"
        ),
        Number.beside(
            "position error far over near, times",
            40.0,
            [one / other for one, other in zip(far, near, strict=True)],
            "published: 0.4 m over 0.01 m, the ratio itself is not stated; the bound for a fixed pixel error "
            f"grows as the distance squared, {squared:.0f} times between these distances",
            2.0,
        ),
        Number.beside(
            "distance at the last solved frame, m",
            15.0,
            [float(found.distances_m[found.last(side)]) for side in SIDES],
            "the size of the tips was chosen for it",
            is_put_in=True,
        ),
        Number.beside(
            "tip at the last solved frame, px",
            1.0,
            [tip_px(found, side) for side in SIDES],
            "published: below one pixel a point is not recognised",
            1.3,
        ),
    ]
    numbers += [
        Number.beside(
            f"{what} error {after_s:g} s after the last solved frame, {unit}",
            float("nan"),
            [float(pick(found.courses[side])[_later(found, side, after_s)]) for side in SIDES],
            "published: the state leaves the true one, without a number",
        )
        for after_s in (40.0, 100.0)
        for what, unit, pick in (("position", "m", _away_m), ("attitude", "deg", _away_deg))
    ]
    words = (
        "The error grows as the square of the distance and the more the fewer pixels a tip has, and no "
        "faster: nothing in it is exponential. Rates by differences of two poses carry their errors into "
        "what is propagated after the tips are lost; a filter's rates hold far longer. "
        "One noise of the pictures: another gives errors that differ by a factor."
    )
    return Drawn(pictures, numbers, words)


def _away_m(course: Course) -> Floats:
    return course.away_m


def _away_deg(course: Course) -> Floats:
    return course.away_deg


def _error_picture(
    found: Simulated, along: Floats, name: str, marks: tuple[float, ...], *, until_last: bool = False
) -> str:
    rows: list[tuple[str, list[Line], tuple[float, float]]] = [
        ("position, m", [], (1e-4, 10.0)),
        ("attitude, deg", [], (1e-3, 100.0)),
        ("all six, m and q", [], (1e-4, 10.0)),
    ]
    for side in SIDES:
        course = found.courses[side]
        stop = found.last(side) + 1 if until_last else len(along)
        six = np.hypot(course.away_m, np.sin(0.5 * np.radians(course.away_deg)))
        for (_, lines, _), values in zip(rows, (course.away_m, course.away_deg, six), strict=True):
            lines.append(Line(WORDS[side], KINDS[side], along[:stop], values[:stop]))
    panels = [Axes(label, lines, span, is_log=True) for label, lines, span in rows]
    start = float(along[0])
    return over_time(panels, start, float(along[-1]), f"errors against {name}", marks, name)
