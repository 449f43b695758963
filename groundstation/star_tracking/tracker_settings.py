"""How hard the star tracker tries and what it believes."""

from dataclasses import dataclass

SIGMAS_PX = (0.06, 0.2, 0.7)
"""Errors of a calibrated camera under a surveyed sky: from a bright star to a blurred one."""
STRAY_RATIO = 0.5
"""A spot is as likely a stray light as a star."""

NEIGHBOUR_RANKS = ((0, 2), (1, 3), (0, 1), (2, 4), (1, 2), (0, 3), (3, 5), (2, 3), (1, 4), (0, 4))
"""Ranks of the neighbours (0 = nearest) that form a triangle with each spot, the most useful first: not the
very nearest alone, whose short arm tells the heading badly."""
RANK_GROUPS = (2, 6, 10)
"""They are tried in groups that end here."""

PRIOR_FREEDOM = 6.0
"""A-priori sigmas count like this many residuals when the scale is judged."""
CLIP_SIGMAS = 3.0
"""Of the robust scale; a few bad centres would otherwise rule the error."""
REFINE_STEPS = 4

MIN_STREAK_PX = 3.0
MIN_STREAKS = 4
MIN_STREAK_SHARE = 0.4
"""Of all spots: a few oblong lights are no motion."""
MAX_MISFIT_RATIO = 0.25
SMEAR_ROUNDS = 6

TEAR_SCATTERS = 6.0
"""A step between the residuals of two parts of a picture is so much larger than the scatter within them."""
TEAR_RATIO = 3.0
"""Two motions, one above the other, leave so much less of the residuals than one does."""


@dataclass(frozen=True, slots=True)
class TrackerSettings:
    """How hard to try and what to believe.

    Attributes:
        tolerance_px: How far a triangle's lengths may be off, as pixels near the axis.
        centre_floor_px: Error of a centre that no fit knows of (PSF, survey), one sigma per axis.
        streak_floor_ratio: The same for streaks, per length: their true shape is not quite the fitted one.
        evidence_nats: Log likelihood over chance that a fix must have: e^-t bounds the false ones.
        rival_nats: Log likelihood that a fix must have over the next best place of the catalogue.
        evidence_sigmas_px: Errors of spots that the likelihood is averaged over.
        min_stars: Stars of a fix without a prior.
        min_stars_prior: Stars of a fix with a prior.
        identified_spots: The brightest so many spots take part in the search.
        pair_spots: The brightest so many take part in the search by pairs.
        pair_spots_total: With more spots than this pairs are not tried.
        look_ups: Cap on tested spot positions per picture.
        candidates: Cap on poses refined per picture.
        tear_nats: Log likelihood over chance from which an end of the picture shows other stars: it is torn.
        tear_px: Step between the residuals of two parts of the picture from which it is torn.
        exposure_s: Of the camera; with a known motion it straightens streaks. 0: streaks tell themselves.
        readout_s: Time from the first to the last row of a rolling shutter; 0 for a global one.
    """

    tolerance_px: float = 1.4
    centre_floor_px: float = 0.012
    streak_floor_ratio: float = 0.002
    evidence_nats: float = 10.5
    rival_nats: float = 30.0
    evidence_sigmas_px: tuple[float, ...] = SIGMAS_PX
    min_stars: int = 4
    min_stars_prior: int = 3
    identified_spots: int = 60
    pair_spots: int = 12
    pair_spots_total: int = 20
    look_ups: int = 80_000
    candidates: int = 100
    tear_nats: float = 4.5
    tear_px: float = 0.2
    exposure_s: float = 0.0
    readout_s: float = 0.0
