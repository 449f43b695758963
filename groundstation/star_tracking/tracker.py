"""The star tracker: spots of a picture in, a fix or the reason for none out."""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import BodyMotion, NoFix, PictureFix, PoseGuess, PosePrior, Refusal
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.search import Found, Search
from groundstation.star_tracking.sky_index import SkyIndex
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker_settings import TrackerSettings

__all__ = ["StarTracker", "TrackerSettings"]

_WHITE_DN = 245.0
_LONG_STREAK_PX = 12.0


class StarTracker:
    """Solves pictures of one ceiling through one camera; for one thread at a time.

    Args:
        catalogue: The stars.
        camera: The camera, its mount and the height of the ceiling.
        settings: How hard to try.

    Raises:
        CoreError: There is no compiled core.
    """

    def __init__(
        self,
        catalogue: StarCatalogue,
        camera: CameraCalibration,
        settings: TrackerSettings | None = None,
    ) -> None:
        self.settings = settings or TrackerSettings()
        self.catalogue = catalogue
        self.rays = CeilingRays(camera)
        tolerance_m = self.settings.tolerance_px * self.rays.scale_m_px
        tolerance_m += 2.0 * float(np.median(catalogue.sigma_m))
        self.sky = SkyIndex(catalogue, tolerance_m, self.rays.reach_m)
        self._is_dropped = np.zeros(len(catalogue) + 1, dtype=bool)  # one more: the star that is none
        self._search = Search(self.sky, self.rays, self.settings, self._is_dropped)

    def drop(self, rows: NDArray[np.int64]) -> None:
        """Match no spot to these rows of the catalogue from now on, and to all others again."""
        self._is_dropped[:] = False
        self._is_dropped[rows] = True

    def solve(
        self, spots: Spots, prior: PosePrior | None = None, motion: BodyMotion | None = None
    ) -> PictureFix | NoFix:
        """Give the pose at the exposure, or say why there is none.

        Args:
            spots: Light spots of one picture, brightest first.
            prior: What is believed of the pose; the fix does not contain it as information.
            motion: Velocity during the exposure, for cameras with a rolling shutter.
        """
        n = len(spots)
        if spots.is_flooded or spots.background_dn > _WHITE_DN:
            return NoFix(Refusal.FLOODED, "More of the picture is lit than a sky of stars can.", n)
        if spots.seam:
            return NoFix(Refusal.TORN, f"{spots.seam[0].upper()}{spots.seam[1:]}.", n)
        needed = self.settings.min_stars if prior is None else self.settings.min_stars_prior
        if n < needed:
            return self._too_few(spots, needed, motion)
        found = self._search.find(spots, prior, motion)
        if found.fix is None:
            return self._refusal(spots, found)
        return self._torn(spots, found) or found.fix

    def _torn(self, spots: Spots, found: Found) -> NoFix | None:
        """Refuse a fix of a picture that shows its stars at two places: one of them is wrong."""
        assert found.fix is not None
        if found.tear_nats >= self.settings.tear_nats:
            detail = "At one end of the picture there are lights, and none where its stars should be."
        elif found.tear_px >= self.settings.tear_px:
            detail = f"Two parts of the picture are {found.tear_px:.2f} px apart"
            detail += "." if self.settings.readout_s else "; or its rows are read out later, see readout_s."
        else:
            return None
        guess = PoseGuess(found.fix.x_m, found.fix.y_m, found.fix.heading_rad)
        return NoFix(Refusal.TORN, detail, len(spots), found.best_nats, guess)

    def _too_few(self, spots: Spots, needed: int, motion: BodyMotion | None) -> NoFix:
        """Say why there are not even enough spots to begin with: no light, or light drawn out too thin."""
        n = len(spots)
        if _are_streaks(spots):
            return NoFix(Refusal.BLURRED, f"{n} spots, most of them streaks.", n)
        if motion is not None and self.settings.exposure_s > 0.0:
            path_m = math.hypot(motion.vx_table_m_s, motion.vy_table_m_s)
            path_m += 0.5 * self.rays.reach_m * abs(motion.rate_rad_s)
            streak_px = path_m * self.settings.exposure_s / self.rays.scale_m_px
            if streak_px > _LONG_STREAK_PX:
                return NoFix(Refusal.BLURRED, f"{n} spots; stars are streaks of {streak_px:.0f} px.", n)
        if n == 0:
            return NoFix(Refusal.NO_SPOTS, "No spot stands out of the noise.", 0)
        return NoFix(Refusal.TOO_FEW_STARS, f"{n} spots, a fix needs {needed}.", n)

    def _refusal(self, spots: Spots, found: Found) -> NoFix:
        n = len(spots)
        guess = None
        if _are_streaks(spots):
            length = np.hypot(spots.streak_px[:, 0], spots.streak_px[:, 1])
            reason = Refusal.BLURRED
            detail = f"{n} spots, most of them streaks of {float(np.median(length)):.0f} px."
        elif found.is_ambiguous:
            reason, detail = Refusal.NO_CONSENSUS, "More than one place of the catalogue explains the spots."
            guess = found.best_guess
        elif math.isfinite(found.best_nats) and found.best_nats > 0.0:
            reason, detail = Refusal.NO_CONSENSUS, "A pose explains some spots, but chance could as well."
            guess = found.best_guess
        elif n < 2 * self.settings.min_stars:
            reason, detail = Refusal.TOO_FEW_STARS, f"{n} spots fit no place of the catalogue for certain."
        else:
            reason, detail = Refusal.NOT_OUR_CEILING, f"{n} spots fit no place of the catalogue."
        return NoFix(reason, detail, n, found.best_nats, guess)


def _are_streaks(spots: Spots) -> bool:
    length = np.hypot(spots.streak_px[:, 0], spots.streak_px[:, 1])
    return bool(np.count_nonzero(length > _LONG_STREAK_PX) > 0.5 * len(spots))
