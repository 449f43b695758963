"""What a star tracker answers: a fix with covariance, or a reason why there is none."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray


class Mode(StrEnum):
    """How the stars of a fix were found."""

    LOST_IN_SPACE = "lost-in-space"
    TRACKING = "tracking"
    PUBLISHED = "published"


class Refusal(StrEnum):
    """Why a picture gives no fix; the value is the word on screens and in files."""

    NO_SPOTS = "no light spots"
    TOO_FEW_STARS = "too few stars"
    FLOODED = "picture flooded with light"
    BLURRED = "too blurred"
    NO_CONSENSUS = "no consensus"
    NOT_OUR_CEILING = "not our ceiling"
    TORN = "torn picture"
    DAMAGED = "damaged picture"


@dataclass(frozen=True, slots=True, eq=False)
class PosePrior:
    """What is believed of the pose before looking: body origin and heading at the exposure.

    Attributes:
        x_table_m: Mean.
        y_table_m: Mean.
        heading_rad: Mean.
        covariance: Covariance (3, 3) of (x, y, heading) in m and rad.
    """

    x_table_m: float
    y_table_m: float
    heading_rad: float
    covariance: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BodyMotion:
    """Velocity during the exposure, table frame; what the rolling-shutter term needs."""

    vx_table_m_s: float
    vy_table_m_s: float
    rate_rad_s: float


@dataclass(frozen=True, slots=True, eq=False)
class PictureFix:
    """A pose with its covariance and its witnesses.

    Attributes:
        x_m: Body origin in the table.
        y_m: Body origin in the table.
        heading_rad: Heading in (-pi, pi].
        covariance: Covariance (3, 3) of (x, y, heading) in m and rad.
        stars: Number of stars that the pose rests on.
        mode: How they were found.
        spot_index: Which spots were matched, shape (stars,).
        star_index: The catalogue rows that they are, shape (stars,).
        residual_m: Spot minus star on the ceiling, shape (stars, 2), m.
        evidence_nats: Log of the likelihood over chance that the match has, prior volume included.
    """

    x_m: float
    y_m: float
    heading_rad: float
    covariance: NDArray[np.float64]
    stars: int
    mode: Mode
    spot_index: NDArray[np.int64]
    star_index: NDArray[np.int64]
    residual_m: NDArray[np.float64]
    evidence_nats: float

    @property
    def sigma_x_m(self) -> float:
        """One sigma of x."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def sigma_y_m(self) -> float:
        """One sigma of y."""
        return float(np.sqrt(self.covariance[1, 1]))

    @property
    def sigma_heading_rad(self) -> float:
        """One sigma of the heading."""
        return float(np.sqrt(self.covariance[2, 2]))


@dataclass(frozen=True, slots=True)
class PoseGuess:
    """A pose that some spots agree on, not enough to be believed; it is for people to look at."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class NoFix:
    """No pose, and why.

    Attributes:
        reason: The kind of refusal.
        detail: One sentence for people.
        spots: How many light spots were there.
        evidence_nats: Best log-likelihood over chance that any hypothesis reached.
        guess: The pose of that hypothesis, where it explains more than chance does.
    """

    reason: Refusal
    detail: str
    spots: int
    evidence_nats: float = field(default=float("-inf"))
    guess: PoseGuess | None = None
