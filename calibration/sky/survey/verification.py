"""How a star list fits pictures that it was made without."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from calibration.sky.survey.surveyed_sky import SurveyedSky
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker
from groundstation.star_tracking.tracker_settings import TrackerSettings

Array = NDArray[np.float64]

_NEAR_M = 0.05
_NEAR_SHARE = 0.4  # of the distance to the next star: a light farther off may be either's


@dataclass(frozen=True, slots=True, eq=False)
class Verification:
    """How pictures fit a star list that was made without them.

    Attributes:
        pictures: How many were held out.
        solved: How many of them could be solved.
        residual_m: Spot minus star on the ceiling, shape (k, 2), of the spots that the poses rest on.
        spots: How many spots the solved pictures have.
        clipped: How many of them lie near a star, yet too far off for the pose to rest on them. Many of
            them say that the list is worse than its residuals.
        star_sigma_m: Root mean square per axis of the stars' mean residuals, of stars seen three times or
            more: what is wrong with the places themselves; NaN if there is none.
        worst_star: Name of the star that is farthest off, empty if there is none.
        worst_m: How far.
    """

    pictures: int
    solved: int
    residual_m: Array
    spots: int
    clipped: int
    star_sigma_m: float
    worst_star: str
    worst_m: float

    @property
    def rms_m(self) -> float:
        """Root mean square per axis between star and spot; NaN if nothing was solved."""
        return float(np.sqrt((self.residual_m**2).mean())) if len(self.residual_m) else math.nan

    @property
    def matched_ratio(self) -> float:
        """Share of the spots that the poses rest on; NaN if nothing was solved."""
        return len(self.residual_m) / self.spots if self.spots else math.nan

    @property
    def clipped_ratio(self) -> float:
        """Share of the spots that were clipped; NaN if nothing was solved."""
        return self.clipped / self.spots if self.spots else math.nan


def sentence_of(found: Verification) -> str:
    """Return what a verification states, in words."""
    if not found.solved:
        return f"verification: none of {found.pictures} pictures held out could be solved."
    words = (
        f"verification: {found.solved} of {found.pictures} pictures held out solved, "
        f"{1e3 * found.rms_m:.3f} mm per axis between star and spot "
        f"({100.0 * found.matched_ratio:.1f} % of {found.spots} spots matched, "
        f"{100.0 * found.clipped_ratio:.1f} % near a star but clipped)"
    )
    if found.worst_star:
        words += (
            f", {1e3 * found.star_sigma_m:.3f} mm of the stars themselves, "
            f"star {found.worst_star} farthest off by {1e3 * found.worst_m:.2f} mm"
        )
    return words + "."


_ON_TRIAL = TrackerSettings(tear_nats=math.inf, tear_px=math.inf)
"""The list is judged, not the pictures: stars that lie elsewhere are counted, and tear no picture."""


def verify(sky: SurveyedSky, held: Sequence[Spots]) -> Verification:
    """Solve pictures with the stars of a survey that they had no part in."""
    x_m, y_m = sky.star_m.T
    sigma_m = np.sqrt((sky.sigma_m**2).mean(axis=1))
    catalogue = StarCatalogue(sky.ids, x_m.copy(), y_m.copy(), sigma_m)
    tracker = StarTracker(catalogue, sky.camera, _ON_TRIAL)
    answers = [(tracker.solve(spots), spots) for spots in held]
    solved = [(answer, spots) for answer, spots in answers if isinstance(answer, PictureFix)]
    fixes = [fix for fix, _ in solved]
    if not fixes:
        return Verification(len(held), 0, np.zeros((0, 2)), 0, 0, math.nan, "", math.nan)
    total_spots = sum(len(spots) for _, spots in solved)
    near = _near_a_star(sky, tracker.rays, solved)
    clipped = near - sum(fix.stars for fix in fixes)
    star = np.concatenate([fix.star_index for fix in fixes])
    residual = np.concatenate([fix.residual_m for fix in fixes])
    count = np.bincount(star, minlength=len(sky.ids))
    total = np.stack([np.bincount(star, residual[:, i], len(sky.ids)) for i in (0, 1)], axis=1)
    often = np.flatnonzero(count >= 3)
    if len(often) == 0:
        return Verification(len(held), len(fixes), residual, total_spots, clipped, math.nan, "", math.nan)
    mean = total[often] / count[often, None]
    off = np.hypot(mean[:, 0], mean[:, 1])
    worst = int(off.argmax())
    star_sigma_m = float(np.sqrt((mean**2).mean()))
    return Verification(
        pictures=len(held),
        solved=len(fixes),
        residual_m=residual,
        spots=total_spots,
        clipped=clipped,
        star_sigma_m=star_sigma_m,
        worst_star=sky.ids[int(often[worst])],
        worst_m=float(off[worst]),
    )


def _near_a_star(sky: SurveyedSky, rays: CeilingRays, solved: Sequence[tuple[PictureFix, Spots]]) -> int:
    """Count the spots that are matched, or whose place by the pose lies near a star."""
    tree = cKDTree(sky.star_m)
    apart = np.asarray(tree.query(sky.star_m, k=2)[0])[:, 1]
    gate_m = np.minimum(_NEAR_M, _NEAR_SHARE * apart)
    count = 0
    for fix, spots in solved:
        place = np.exp(1j * fix.heading_rad) * rays.look_up(spots.u_px, spots.v_px).q_body_m
        place += complex(fix.x_m, fix.y_m)
        off, star = tree.query(np.stack((place.real, place.imag), axis=1))
        is_near = np.asarray(off) < gate_m[np.asarray(star, dtype=np.int64)]
        is_near[fix.spot_index] = True
        count += int(is_near.sum())
    return count


def none_of(spots: Spots) -> Spots:
    """A picture without any spot."""
    none, background, noise = np.zeros(0), spots.background_dn, spots.noise_dn
    return Spots(none, none, none, np.zeros((0, 3)), none, np.zeros((0, 2)), background, noise)
