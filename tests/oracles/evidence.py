"""Is it our ceiling? The likelihood of the spots over chance, as a Bayes factor.

Chance: every spot is a light somewhere in the picture, uniformly. Ours: a spot is a stray light with
probability 1/2, else a catalogue star seen with a Gaussian error; the pose itself is integrated over
its prior by Laplace's method, which charges the match for every place and heading that it could have
had (Kass and Raftery, Bayes Factors, JASA 90, 1995). The error's sigma is not known (survey, tilt,
blur), so the factor is averaged over several.

Under chance the mean of a Bayes factor is one, so by Markov's inequality it exceeds exp(t) in less
than exp(-t) of all pictures of random lights: the threshold is a rate of false fixes.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.star_tracking.tracker_settings import SIGMAS_PX, STRAY_RATIO


@dataclass(frozen=True, slots=True)
class Chance:
    """What chance could do.

    Attributes:
        density_m2: Stars per area of ceiling.
        pose_volume_m2_rad: Prior volume of poses: area times 2 pi, or that of a Gaussian prior.
        scale_m_px: Length of one pixel on the ceiling.
        sigmas_px: Sigmas to average over.
    """

    density_m2: float
    pose_volume_m2_rad: float
    scale_m_px: float
    sigmas_px: tuple[float, ...] = SIGMAS_PX


def evidence_nats(distance_m: NDArray[np.float64], lever_m: float, spots: int, chance: Chance) -> float:
    """Give the log Bayes factor of a match.

    Args:
        distance_m: Spot to star for the matched spots, shape (n,).
        lever_m: Root of the summed squared distances of the matched spots from their mean.
        spots: All spots of the picture; the others count as stray lights.
        chance: What chance could do.
    """
    n = len(distance_m)
    unmatched = (spots - n) * math.log(STRAY_RATIO)
    terms = []
    for sigma_px in chance.sigmas_px:
        sigma = sigma_px * chance.scale_m_px
        seen = np.exp(-0.5 * (distance_m / sigma) ** 2) / (2.0 * math.pi * sigma * sigma)
        matched = float(np.log(STRAY_RATIO + (1.0 - STRAY_RATIO) / chance.density_m2 * seen).sum())
        posterior = (2.0 * math.pi) ** 1.5 * sigma**3 / (n * max(lever_m, 1e-6))
        terms.append(matched + math.log(min(posterior / chance.pose_volume_m2_rad, 1.0)))
    best = max(terms)
    return unmatched + best + math.log(sum(math.exp(t - best) for t in terms) / len(terms))
