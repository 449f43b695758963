"""Between the pictures of a side camera: where the other mock-up is against the own one, and how it moves.

State: the other's origin from the own one (table axes), the other's velocity, its heading and turn rate.
The own motion is known far better than the other's, so it is taken away as it happened: the filter is given
the way that the own estimate's *velocity* adds up to, which corrections of its pose do not touch. The other
is moved by pushes that nobody here knows: its acceleration is white noise. A picture's covariance couples
x, y and heading, so it is one Kalman filter of six states.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.frames import wrap_angle

Floats = NDArray[np.float64]
NS_PER_S = 1e9
Vector2 = tuple[float, float]

ACCELERATION_M_S2_RTHZ = 0.01
"""Of the other mock-up: pulses of 0.44 N on 11 kg, two tenths of the time, 0.1 s each."""
TURN_RAD_S2_RTHZ = 0.05
FIRST_SPEED_M_S, FIRST_RATE_RAD_S = 0.1, 0.2
UNKNOWN_TURN = 1e4
"""Variance that stands for a heading that was never seen, rad^2."""
GATE = 25.0
"""Of a squared distance in sigmas, up to three dimensions: one of a hundred thousand lies outside."""
PATIENCE = 4
"""So many sightings in a row beyond the gate are the truth, and the filter was wrong."""
LONGEST_S = 1.0
"""After such a gap it begins anew."""


@dataclass(frozen=True, slots=True)
class OwnMoment:
    """Where the own mock-up was when a picture was taken.

    Attributes:
        stamp_ns: Of the exposure.
        way_table_m: What its velocity has added up to since any fixed moment.
        heading_rad: Its heading.
        velocity_table_m_s: Its velocity.
        rate_rad_s: Its turn rate.
    """

    stamp_ns: int
    way_table_m: Vector2
    heading_rad: float
    velocity_table_m_s: Vector2
    rate_rad_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Relative:
    """The other mock-up as the filter has it at one moment.

    Attributes:
        away_table_m: Its origin from the own one, table axes, (2,).
        velocity_table_m_s: Its velocity over the table, (2,).
        heading_rad: Its heading in the table; NaN if it was never seen.
        rate_rad_s: Its turn rate; 0 if its heading was never seen.
        covariance: Of place, velocity, heading, rate, (6, 6).
    """

    away_table_m: Floats
    velocity_table_m_s: Floats
    heading_rad: float
    rate_rad_s: float
    covariance: Floats


class RelativeFilter:
    """Takes sightings one after the other."""

    def __init__(self) -> None:
        self._at: OwnMoment | None = None
        self._state = np.zeros(6)
        self._covariance = np.zeros((6, 6))
        self._refused = 0
        self._turn_seen = False

    def take(
        self, own: OwnMoment, place_body_m: Floats, turn_rad: float, covariance: Floats, stamp_sigma_s: float
    ) -> str:
        """Take one sighting; return why it was refused, or nothing.

        Args:
            own: The own mock-up at the exposure.
            place_body_m: The other's origin in the own body frame, (2,).
            turn_rad: Its heading less the own one; NaN if it was not seen.
            covariance: Of both, (3, 3).
            stamp_sigma_s: Of the exposure's moment.
        """
        if self._at is not None and own.stamp_ns <= self._at.stamp_ns:
            return "it is not newer than the one before"
        cosine, sine = math.cos(own.heading_rad), math.sin(own.heading_rad)
        turned = np.array(((cosine, -sine), (sine, cosine)))
        place, spread = turned @ place_body_m, turned @ covariance[:2, :2] @ turned.T
        cross = turned @ covariance[:2, 2]
        has_turn = math.isfinite(turn_rad) and math.isfinite(float(covariance[2, 2]))
        gap_s = math.inf if self._at is None else (own.stamp_ns - self._at.stamp_ns) / NS_PER_S
        drift = self._state[2:4] - own.velocity_table_m_s + own.rate_rad_s * np.array((place[1], -place[0]))
        spread = spread + stamp_sigma_s**2 * np.outer(drift, drift)
        heading = wrap_angle(own.heading_rad + turn_rad) if has_turn else 0.0
        variance = float(covariance[2, 2]) if has_turn else UNKNOWN_TURN
        if gap_s > LONGEST_S:
            self._begin(own, place, spread, heading, variance, has_turn=has_turn)
            return ""
        self._carry(own, gap_s)
        rows = 3 if has_turn else 2
        seen, noise = place, spread
        if has_turn:
            seen = np.append(place, self._state[4] + wrap_angle(heading - self._state[4]))
            noise = np.block([[spread, cross[:, None]], [cross[None], np.array([[variance]])]])
        select = np.zeros((rows, 6))
        select[0, 0] = select[1, 1] = 1.0
        if has_turn:
            select[2, 4] = 1.0
        off = seen - select @ self._state
        innovation = select @ self._covariance @ select.T + noise
        if float(off @ np.linalg.solve(innovation, off)) > GATE:
            self._refused += 1
            if self._refused < PATIENCE:
                return "it contradicts those before"
            self._begin(own, place, spread, heading, variance, has_turn=has_turn)
            return ""
        self._refused = 0
        gain = np.linalg.solve(innovation, select @ self._covariance).T
        self._state = self._state + gain @ off
        left = np.eye(6) - gain @ select
        self._covariance = left @ self._covariance @ left.T + gain @ noise @ gain.T
        self._turn_seen = self._turn_seen or has_turn
        return ""

    def at(self, own: OwnMoment) -> Relative | None:
        """The other mock-up at a moment from the last sighting on; None before the first, or long after."""
        if self._at is None:
            return None
        span_s = (own.stamp_ns - self._at.stamp_ns) / NS_PER_S
        if not 0.0 <= span_s <= LONGEST_S:
            return None
        state, covariance = self._carried(own, span_s)
        return Relative(
            state[:2],
            state[2:4],
            wrap_angle(float(state[4])) if self._turn_seen else math.nan,
            float(state[5]) if self._turn_seen else 0.0,
            covariance,
        )

    def _begin(
        self,
        own: OwnMoment,
        place: Floats,
        spread: Floats,
        heading: float,
        variance: float,
        *,
        has_turn: bool,
    ) -> None:
        self._at, self._refused, self._turn_seen = own, 0, has_turn
        self._state = np.array((*place, 0.0, 0.0, heading, 0.0))
        self._covariance = np.diag((
            0.0, 0.0, FIRST_SPEED_M_S**2, FIRST_SPEED_M_S**2, variance, FIRST_RATE_RAD_S**2
        ))  # fmt: skip
        self._covariance[:2, :2] = spread

    def _carry(self, own: OwnMoment, span_s: float) -> None:
        self._state, self._covariance = self._carried(own, span_s)
        self._at = own

    def _carried(self, own: OwnMoment, span_s: float) -> tuple[Floats, Floats]:
        assert self._at is not None
        step = np.eye(6)
        step[0, 2] = step[1, 3] = step[4, 5] = span_s
        state = step @ self._state
        state[:2] -= np.subtract(own.way_table_m, self._at.way_table_m)
        shape = np.array(((span_s**3 / 3.0, span_s**2 / 2.0), (span_s**2 / 2.0, span_s)))
        noise = np.zeros((6, 6))
        for place, speed, density in (
            (0, 2, ACCELERATION_M_S2_RTHZ), (1, 3, ACCELERATION_M_S2_RTHZ), (4, 5, TURN_RAD_S2_RTHZ),
        ):  # fmt: skip
            noise[np.ix_((place, speed), (place, speed))] = density**2 * shape
        return state, step @ self._covariance @ step.T + noise
