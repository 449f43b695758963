"""The figure of a folder of solved pictures: where the fixes lie, and what each picture took."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from groundstation.files.png import new_figure
from groundstation.star_tracking.fixes import NoFix, PictureFix
from groundstation.star_tracking.star_catalogue import StarCatalogue

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ARROW_M = 0.12


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """What became of each picture, in order.

    Attributes:
        names: Of the pictures.
        found: Fix, or why there is none.
        ms: CPU time that each took.
    """

    names: list[str]
    found: list[PictureFix | NoFix]
    ms: list[float]

    def add(self, name: str, answer: PictureFix | NoFix, ms: float) -> None:
        """Take one more."""
        self.names.append(name)
        self.found.append(answer)
        self.ms.append(ms)

    def rows(self) -> Iterator[tuple[str, PictureFix | NoFix, float]]:
        """Each picture with its answer."""
        return zip(self.names, self.found, self.ms, strict=True)


def draw_answers(answers: Answers, catalogue: StarCatalogue) -> Figure:
    """Draw the fixes among the stars with their headings; CPU time and stars of each picture below."""
    figure = new_figure(9.0, 10.0)
    plan, time, count = figure.subplots(3, 1, height_ratios=[3.0, 1.0, 1.0])
    plan.plot(catalogue.x_m, catalogue.y_m, "*", color="0.75", markersize=5, label="stars of the catalogue")
    fixes = [each for each in answers.found if isinstance(each, PictureFix)]
    x_m, y_m = np.array([each.x_m for each in fixes]), np.array([each.y_m for each in fixes])
    plan.plot(x_m, y_m, ".", color="tab:blue", label=f"{len(fixes)} fixes of {len(answers.found)} pictures")
    for fix in fixes:
        ahead = (
            fix.x_m + ARROW_M * math.cos(fix.heading_rad),
            fix.y_m + ARROW_M * math.sin(fix.heading_rad),
        )
        plan.plot([fix.x_m, ahead[0]], [fix.y_m, ahead[1]], "-", color="tab:blue", linewidth=0.8)
    plan.set_aspect("equal")
    plan.set_xlabel("x, m")
    plan.set_ylabel("y, m")
    plan.legend(loc="upper right", fontsize=8)
    number = np.arange(len(answers.found))
    is_fix = np.array([isinstance(each, PictureFix) for each in answers.found], dtype=np.bool_)
    ms = np.array(answers.ms)
    time.plot(number[is_fix], ms[is_fix], ".", color="tab:blue", label="fix")
    time.plot(number[~is_fix], ms[~is_fix], "x", color="tab:red", label="no fix")
    time.set_ylabel("CPU time, ms")
    time.legend(loc="upper right", ncols=2, fontsize=8)
    stars = [each.stars if isinstance(each, PictureFix) else 0 for each in answers.found]
    count.bar(number, stars, color="0.6")
    count.set_ylabel("stars of the fix")
    count.set_xlabel("picture, in the order of their names")
    return figure
