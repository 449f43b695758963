"""When a prior may be used: never so long that a wrong one could feed itself.

A fix made from a prior agrees with that prior by construction. So every few fixes, after any refusal,
and after a fix that disagrees with its prior, the sky is searched from nothing.
"""

from dataclasses import dataclass

import numpy as np

from groundstation.star_tracking.fixes import Mode, NoFix, PictureFix, PosePrior

_DISAGREEMENT = 21.1  # chi-square of three, 1 in 10,000


@dataclass(frozen=True, slots=True)
class GovernorSettings:
    """How far priors are trusted.

    Attributes:
        confirm_every: After so many fixes in tracking mode one is made lost in space.
        max_sigma_m: A vaguer prior is not worth using.
        max_sigma_heading_rad: A vaguer prior is not worth using.
    """

    confirm_every: int = 10
    max_sigma_m: float = 0.02
    max_sigma_heading_rad: float = 0.02


class PriorGovernor:
    """Decides for each picture whether the prior is used; one per tracker."""

    def __init__(self, settings: GovernorSettings | None = None) -> None:
        self._settings = settings or GovernorSettings()
        self._tracked = 0
        self._is_confirmed = False

    def admit(self, prior: PosePrior | None) -> PosePrior | None:
        """Give the prior if it may be used for the next picture, else None."""
        settings = self._settings
        if prior is None or not self._is_confirmed or self._tracked >= settings.confirm_every:
            return None
        sigma = np.sqrt(np.diag(prior.covariance))
        vague = not (
            max(sigma[0], sigma[1]) <= settings.max_sigma_m and sigma[2] <= settings.max_sigma_heading_rad
        )  # written so that a covariance of NaN is vague
        return None if vague else prior

    def note(self, answer: PictureFix | NoFix, prior: PosePrior | None = None) -> None:
        """Learn what became of a picture.

        Args:
            answer: The tracker's.
            prior: What was believed before, whether it was used or not.
        """
        if isinstance(answer, NoFix):
            self._is_confirmed = False
            return
        if answer.mode is Mode.TRACKING:
            self._tracked += 1
        else:
            self._tracked = 0
            self._is_confirmed = True
        if prior is not None and disagreement(answer, prior) > _DISAGREEMENT:
            self._is_confirmed = False


def disagreement(fix: PictureFix, prior: PosePrior) -> float:
    """Give the squared Mahalanobis distance of a fix from a prior that does not contain it."""
    turn = fix.heading_rad - prior.heading_rad
    off = np.array(
        [fix.x_m - prior.x_table_m, fix.y_m - prior.y_table_m, np.arctan2(np.sin(turn), np.cos(turn))]
    )
    return float(off @ np.linalg.solve(fix.covariance + prior.covariance, off))
