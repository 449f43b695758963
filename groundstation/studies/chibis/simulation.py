"""A film like the published one, rendered by the emulator, and followed by both sides."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import Separation, SeparationOrder, fly_separation
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.spots import SpotFinder, SpotSettings
from groundstation.studies.chibis.condition import RATE_RAD_S, simulation
from groundstation.studies.following import Course, follow, settings_of, tracker_of
from groundstation.studies.study import DEFAULT, PUBLISHED, Generated, Progress

Floats = NDArray[np.float64]

LOOKS = {PUBLISHED: SpotSettings(method="contour"), DEFAULT: SpotSettings()}
"""How each side looks at pictures."""
SIDES = (PUBLISHED, DEFAULT)
WORDS = {PUBLISHED: "published methods", DEFAULT: "our defaults"}
KINDS = {PUBLISHED: "v1", DEFAULT: "v0"}
GAP = 10
"""So many unsolved frames in a row end the work, 40 s."""


@dataclass(frozen=True, slots=True, eq=False)
class Simulated:
    """A separation and what both sides made of its pictures.

    Attributes:
        order: That was flown.
        truth: Of it.
        centres: Of each side, a frame each.
        courses: Of each side.
    """

    order: SeparationOrder
    truth: Separation
    centres: Mapping[str, list[Centres]]
    courses: Mapping[str, Course]

    @property
    def distances_m(self) -> Floats:
        """True ones, (n,)."""
        found: Floats = np.linalg.norm(self.truth.positions_camera_m, axis=1)
        return found

    def last(self, side: str) -> int:
        """Number of the last frame before a side's work ends; the first one if it never began."""
        return self.courses[side].last_solved(GAP) or 0


def simulate(order: SeparationOrder, progress: Progress, words: str = "filming") -> Simulated:
    """Fly and film an order, and follow it by both sides."""
    truth = fly_separation(order)
    finders = {side: SpotFinder(LOOKS[side]) for side in SIDES}
    centres: dict[str, list[Centres]] = {side: [] for side in SIDES}
    count = len(order.times_s)
    for number in range(count):
        progress(words, number / count)
        picture = truth.picture(number)
        for side, finder in finders.items():
            centres[side].append(finder.look(picture).centres)
    courses = {}
    for side in SIDES:
        settings = settings_of(order, truth, rate_rad_s=RATE_RAD_S)
        courses[side] = follow(tracker_of(side, settings), truth, centres[side])
    return Simulated(order, truth, centres, courses)


SIMULATION = Generated(partial(simulate, simulation()), 1.0)


def tip_px(found: Simulated, side: str, number: int | None = None) -> float:
    """Diameter of a tip in a picture; in the last one that a side could use if none is named."""
    order = found.order
    depth = float(found.truth.positions_camera_m[found.last(side) if number is None else number, 2])
    return order.f_px * order.looks.tip_diameter_m / depth
