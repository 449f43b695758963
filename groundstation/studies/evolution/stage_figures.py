"""Figures 2 and 3, table 1: the precession of the stage, and the errors of its rates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from groundstation.relative_navigation.error_table import PUBLISHED_STAGE, ErrorStatistics, error_statistics
from groundstation.relative_navigation.precession import precession_of
from groundstation.studies.evolution.stage import RATE_DEG_S, STAGE, StageErrors
from groundstation.studies.histograms import histograms
from groundstation.studies.study import DEFAULT, PUBLISHED, Drawn, Number

NAN = math.nan


def draw_precession(data: Mapping[str, Any]) -> Drawn:
    """Figure 2 and formulas (1)."""
    del data
    found = precession_of(np.radians(RATE_DEG_S), STAGE.inertia)
    numbers = [
        Number("half angle of the cone alpha, deg", ours=math.degrees(found.half_angle_rad)),
        Number("transverse momentum, kg m^2/s", ours=found.momentum_across),
        Number("momentum along the axis, kg m^2/s", ours=found.momentum_along),
        Number("momentum, kg m^2/s", ours=found.momentum),
        Number(
            "rate of precession psi' by the printed formula, deg/s",
            ours=math.degrees(found.published_rate_rad_s),
            assumed="it has the sign of w_x",
        ),
        Number("rate about the momentum vector, K/In, deg/s", ours=math.degrees(found.rate_rad_s)),
        Number(
            "from the momentum to the axis, deg",
            ours=math.degrees(found.axis_angle_rad),
            assumed="w_x is negative: the axis lies on the other side of what alpha is measured from",
        ),
    ]
    words = (
        "The formulas give what is not printed. Their alpha lies between 0 and 90 degrees whatever the sign "
        "of w_x; with a negative one the precession about the momentum is positive and the axis lies at 180 "
        "degrees less alpha."
    )
    return Drawn([], numbers, words)


def _statistics(found: StageErrors, axis: int) -> dict[str, ErrorStatistics]:
    return {side: error_statistics(off[:, axis]) for side, off in found.off_deg_s.items()}


def draw_histograms(data: Mapping[str, StageErrors]) -> Drawn:
    """Figure 3: how errors are distributed."""
    found = data["stage"]
    rows = [
        (f"w{name}", [found.off_deg_s[PUBLISHED][:, axis], found.off_deg_s[DEFAULT][:, axis]])
        for axis, name in enumerate("xyz")
    ]
    count = len(found.off_deg_s[PUBLISHED])
    entries = (("v1", "differential evolution"), ("v0 thick", "least squares"))
    picture = histograms(rows, entries, 1.0, 40, "errors of the rates", "error, deg/s")
    numbers = [Number("runs", 500.0, float(count), float(count), is_put_in=True)]
    for axis, name in enumerate("xyz"):
        sides = _statistics(found, axis)
        numbers.append(
            Number.beside(
                f"mean error of w{name}, deg/s",
                NAN,
                [sides[side].mean for side in (PUBLISHED, DEFAULT)],
                "signed: no bias beyond its own scatter of rms over the root of the runs",
            )
        )
    apart = found.off_deg_s[PUBLISHED] - found.off_deg_s[DEFAULT]
    numbers += [
        Number("evolution and least squares apart, deg/s rms", ours=float(np.sqrt(np.mean(apart**2)))),
        Number("poses that the search tries in a run", ours=found.evaluations),
    ]
    words = (
        "Shares of runs with an error in each bin. Evolution ends where least squares ends: the errors are "
        "those of the pixels and of the geometry, not of the search."
    )
    return Drawn([(f"{count} runs.", picture)], numbers, words)


def draw_table(data: Mapping[str, StageErrors]) -> Drawn:
    """Table 1 by the published formulas, and honest statistics."""
    found = data["stage"]
    numbers = []
    sides = (PUBLISHED, DEFAULT)
    for axis, name in enumerate("xyz"):
        mean, variance, sigma = PUBLISHED_STAGE[name]
        own = _statistics(found, axis)
        numbers += [
            Number.beside(
                f"M of w{name} as mean absolute error, deg/s",
                mean,
                [own[side].mean_absolute for side in sides],
                "the formula gives the signed mean, which is near zero; the printed M can only be this",
            ),
            Number.beside(
                f"D of w{name} by the published formula, deg^2/s^2",
                variance,
                [own[side].published_variance for side in sides],
                "sum of squares over n (n - 1): the variance of a mean, and smaller the more runs there are",
            ),
            Number.beside(
                f"sigma of w{name} by the published formula, deg/s",
                sigma,
                [own[side].published_sigma for side in sides],
                f"the root of D; the printed one is not the root of the printed D, {math.sqrt(variance):.4f}",
            ),
            Number.beside(
                f"sample variance of w{name}, deg^2/s^2",
                NAN,
                [own[side].variance for side in sides],
                "honest",
            ),
            Number.beside(
                f"rms error of w{name}, deg/s",
                math.sqrt(499.0 * variance),
                [own[side].rms for side in sides],
                "published: the root of D (n - 1)",
            ),
            Number(
                f"least possible rms of w{name}, deg/s",
                ours=float(found.bound_deg_s[axis]),
                assumed="Cramer-Rao",
            ),
        ]
    along, *across = (_statistics(found, axis)[PUBLISHED].rms for axis in range(3))
    words = (
        "By its own formulas the table looks far more accurate than a run is: D is divided by n (n - 1). A "
        f"single run errs by {along:.3f} deg/s rms along the axis and by {across[0]:.3f} and {across[1]:.3f} "
        "across it, at the bound of this geometry. Camera, markers and noise were chosen near the table, so "
        "its numbers have no verdict here. Two things need none: both transverse axes must be alike for a "
        "body of revolution, and the published z row is unlike y; the published sigmas of x and z are not "
        "the roots of their D."
    )
    return Drawn([], numbers, words)
