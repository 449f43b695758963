"""Figures 4, 8, 9 and 10: the triangulated sky, the star tracker about the perimeter, and at rest."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from groundstation.declarations.rig_file import RigFile
from groundstation.parts.stars.sections import StarsOfType
from groundstation.rig.read import load_rig
from groundstation.star_tracking.delaunay import triangles_of
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.studies.air_table.estimates import Array, star_curve
from groundstation.studies.air_table.rigs import RIGS
from groundstation.studies.flown import Flown, Sides
from groundstation.studies.plots import Axes, Line, Plan, over_time
from groundstation.studies.study import DEFAULT, PUBLISHED, Drawn, Number

NAN = math.nan
TRIANGLES = 322
STARS = 180
TYPICAL_S, MEAN_S, WORST_S = 0.6, 0.72, 2.7
AT_BEST_MM = 1.0
ARROW_S = 2.0
"""An arrow is as long as the way of so many seconds."""
TABLE = Plan((-1.7, 1.7), (-1.15, 1.15))


def draw_sky(flights: Mapping[str, Sides]) -> Drawn:
    """Figure 4: the triangulation of all stars."""
    del flights
    rig = load_rig(RIGS[PUBLISHED])
    (type_,) = rig.mock_ups.values()
    assert isinstance(type_, StarsOfType)
    assert type_.star_camera is not None
    ceiling: RigFile = type_.star_camera.ceiling
    stars = ceiling.value(StarCatalogue.parse)
    points = np.column_stack([stars.x_m, stars.y_m])
    triangles, _ = triangles_of(points)
    plan = Plan(
        (float(points[:, 0].min()) - 0.1, float(points[:, 0].max()) + 0.1),
        (float(points[:, 1].min()) - 0.1, float(points[:, 1].max()) + 0.1),
    )
    corners = points[triangles[:, [0, 1, 2, 0]]]
    corners = np.concatenate([corners, np.full((len(corners), 1, 2), np.nan)], axis=1).reshape(-1, 2)
    parts = [plan.way(corners[:, 0], corners[:, 1], "v0 thin"), plan.dots(points[:, 0], points[:, 1], "v4")]
    picture = plan.picture(parts, (("v4", "LEDs"), ("v0", "Delaunay triangles")), "Triangulated ceiling")
    numbers = [
        Number("LEDs", STARS, len(points), NAN, is_put_in=True),
        Number(
            "triangles of the catalogue",
            TRIANGLES,
            len(triangles),
            NAN,
            "358 less the LEDs on the convex hull: the published layout has 36 of them there, ours fewer",
            ratio=1.005,
        ),
    ]
    words = "The emulated LEDs hang at random over 5 by 4 m, so that fewer of them lie on the rim."
    caption = "The LEDs of the emulated ceiling and their triangulation, uncut."
    return Drawn([(caption, picture)], numbers, words)


def draw_perimeter(flights: Mapping[str, Sides]) -> Drawn:
    """Figures 8 and 9: fixes about the perimeter, failures marked, and the time that each took."""
    sides = flights["perimeter"]
    pictures = []
    for side, name in ((PUBLISHED, "Published methods"), (DEFAULT, "Our defaults")):
        flown = sides[side]
        pictures.append((f"{name}: fixes, velocities, and asterisks where a try failed.", _track(flown)))
        pictures.append((f"{name}: time that each fix took, against time.", _times(flown)))
    ours, default = (_spent_s(sides[side]) for side in (PUBLISHED, DEFAULT))
    failed = [_failed_share(sides[side]) for side in (PUBLISHED, DEFAULT)]
    numbers = [
        Number.beside("typical time of a fix, s", TYPICAL_S, map(_median, (ours, default)), is_put_in=True),
        Number(
            "mean time of a fix, s",
            MEAN_S,
            float(ours.mean()),
            float(default.mean()),
            "level and limits were chosen for about this",
            is_put_in=True,
        ),
        Number(
            "longest time of a fix, s",
            WORST_S,
            float(ours.max()),
            float(default.max()),
            "called four pictures of 0.6 s; a rare event, so it hangs on chance",
            ratio=1.6,
        ),
        Number.beside(
            "share of tries that fail",
            1.0 - TYPICAL_S / MEAN_S,
            failed,
            "deduced from the two times for independent tries, not stated",
            is_put_in=True,
        ),
    ]
    words = (
        "A try fails where no two triangles place the camera alike: here, where LEDs are dimmer than the "
        "level below which a pixel becomes zero. The times are whole multiples of 0.6 s, as published."
    )
    return Drawn(pictures, numbers, words)


def _track(flown: Flown) -> str:
    t_s, x_m, y_m = star_curve(flown)[:, :3].T
    vx, vy = star_curve(flown)[:, 4:6].T
    flying = t_s > 0.0
    failed = flown.tries[(flown.tries[:, 2] == 0.0) & (flown.tries[:, 0] > flown.zero_s)]
    fx_m, fy_m = flown.truth(failed[:, 0])[:2]
    parts = [
        TABLE.way(x_m[flying], y_m[flying], "v0"),
        TABLE.arrows(x_m[flying], y_m[flying], ARROW_S * vx[flying], ARROW_S * vy[flying]),
        TABLE.dots(x_m[flying], y_m[flying], "v0"),
        TABLE.asterisks(fx_m, fy_m, "failure"),
    ]
    return TABLE.picture(parts, (("v0", "fixes"), ("failure", "no fix")), "Fixes on the table")


def _spent_s(flown: Flown) -> Array:
    """Return how long each fix took: from the fix before, in flight."""
    fixes = flown.tries[flown.tries[:, 2] == 1.0]
    return np.diff(fixes[fixes[:, 1] > flown.zero_s, 1])


def _times(flown: Flown) -> str:
    fixes = flown.tries[flown.tries[:, 2] == 1.0]
    t_s = fixes[fixes[:, 1] > flown.zero_s, 1][1:] - flown.zero_s
    line = Line("time of a fix", "v0", t_s, _spent_s(flown), is_dots=True)
    return over_time([Axes("time, s", [line], (0.0, 4.0))], 0.0, float(t_s.max()) + 1.0, "Time of each fix")


def _failed_share(flown: Flown) -> float:
    flying = flown.tries[flown.tries[:, 1] > flown.zero_s]
    return float(np.mean(flying[:, 2] == 0.0))


def _median(values: Array) -> float:
    return float(np.median(values))


def draw_rest(flights: Mapping[str, Sides]) -> Drawn:
    """Figure 10: one coordinate at rest."""
    sides = flights["rest"]
    pictures, scatter_mm, off_mm = [], [], []
    for side, name in ((PUBLISHED, "Published methods"), (DEFAULT, "Our defaults")):
        flown = sides[side]
        stars = flown.data.stars[flown.data.stars[:, 0] < flown.data.run_start_s]
        truth_m = float(flown.truth(stars[:1, 0])[0, 0])
        x_mm = 1e3 * (stars[:, 2] - truth_m)
        scatter_mm.append(float(np.std(x_mm)))
        off_mm.append(float(np.mean(x_mm)))
        t_s = stars[:, 0] - stars[0, 0]
        line = Line("x by stars, minus its true value", "v0", t_s, x_mm, is_dots=True)
        joined = Line("", "v0", t_s, x_mm)
        axes = Axes("x, mm", [joined, line], (-6.0, 6.0))
        pictures.append((f"{name}: x of a mock-up at rest.", over_time([axes], 0.0, 60.0, "x at rest")))
    numbers = [
        Number.beside(
            "scatter of x at rest, mm (1 sigma)",
            AT_BEST_MM,
            scatter_mm,
            "published is 'of the order of one millimetre' at best",
            ratio=3.0,
        ),
        Number.beside("mean of x off its true value, mm", NAN, off_mm, "no truth was published"),
    ]
    words = (
        "The scatter comes from the same stars in other triangles from picture to picture; the mean is "
        "off because an affine map knows nothing of the lens's distortion. Our defaults are calibrated "
        "for both."
    )
    return Drawn(pictures, numbers, words)
