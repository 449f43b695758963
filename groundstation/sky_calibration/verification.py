"""How a star list fits pictures that it was made without."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.camera.star_catalogue import StarCatalogue
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import StarFix
from groundstation.star_tracking.survey import SurveyedSky
from groundstation.star_tracking.tracker import StarTracker

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """How pictures fit a star list that was made without them.

    Attributes:
        pictures: How many were held out.
        solved: How many of them could be solved.
        residual_m: Spot minus star on the ceiling, shape (k, 2).
        star_std_m: Root mean square per axis of the stars' mean residuals, of stars seen three times or
            more: what is wrong with the places themselves; NaN if there is none.
        worst_star: Name of the star that is farthest off, empty if there is none.
        worst_m: How far.
    """

    pictures: int
    solved: int
    residual_m: Array
    star_std_m: float
    worst_star: str
    worst_m: float

    @property
    def rms_m(self) -> float:
        """Root mean square per axis between star and spot; NaN if nothing was solved."""
        return float(np.sqrt((self.residual_m**2).mean())) if len(self.residual_m) else math.nan


def verify(sky: SurveyedSky, held: Sequence[Spots]) -> Verification:
    """Solve pictures with the stars of a survey that they had no part in."""
    x_m, y_m = sky.star_m.T
    std_m = np.sqrt((sky.std_m**2).mean(axis=1))
    tracker = StarTracker(StarCatalogue(sky.ids, x_m.copy(), y_m.copy(), std_m), sky.camera)
    answers = (tracker.solve(spots) for spots in held)
    fixes = [answer for answer in answers if isinstance(answer, StarFix)]
    if not fixes:
        return Verification(len(held), 0, np.zeros((0, 2)), math.nan, "", math.nan)
    star = np.concatenate([fix.star_index for fix in fixes])
    residual = np.concatenate([fix.residual_m for fix in fixes])
    count = np.bincount(star, minlength=len(sky.ids))
    total = np.stack([np.bincount(star, residual[:, i], len(sky.ids)) for i in (0, 1)], axis=1)
    often = np.flatnonzero(count >= 3)
    if len(often) == 0:
        return Verification(len(held), len(fixes), residual, math.nan, "", math.nan)
    mean = total[often] / count[often, None]
    off = np.hypot(mean[:, 0], mean[:, 1])
    worst = int(off.argmax())
    star_std_m = float(np.sqrt((mean**2).mean()))
    return Verification(
        len(held), len(fixes), residual, star_std_m, sky.ids[int(often[worst])], float(off[worst])
    )


def none_of(spots: Spots) -> Spots:
    """A picture without any spot."""
    none, background, noise = np.zeros(0), spots.background_dn, spots.noise_dn
    return Spots(none, none, none, np.zeros((0, 3)), none, np.zeros((0, 2)), background, noise)
