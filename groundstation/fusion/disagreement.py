"""Why packets and fixes contradict each other, where an estimator was lost: judged by how the vehicle turned.

The turn between two fixes is the gyro's between their exposures. Where it is not, the one that explains the
fixes is looked for: the other sign, another unit, the exposures of another clock. Accelerations are not
judged: a change of place takes two integrals and the slope of the table.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.estimator import FixOutcome
from groundstation.fusion.flight_data import FlightData
from groundstation.fusion.stamp_screen import LONG_GAP_S

Array = NDArray[np.float64]

APART_S = (0.0, 3.0, 9.0)
"""Fixes are compared with the next that is so much later: slow turns show over seconds."""
LONGEST_PAIR_S = 15.0
LEAST_PAIRS = 12
KEPT = 0.75
"""Share of the pairs that counts: one fix in ten may be wrong, and each is in several pairs."""
FARTHEST_S, LAG_STEP_S = 30.0, 0.05
TURNED_SIGMAS = 5.0
"""Of the fixes' difference; with less turning no cause can be told from another."""
CONTRADICTED_SIGMAS = 3.0
SCALE_ERROR = 0.05
"""Of a gyro that nobody has calibrated: so much of a turn is no contradiction."""
BETTER = 0.4
"""Share of the scatter that is left if the cause is the right one."""
LEAST_LAG_S = 0.15
MANY_LOST = 2
SCALES = (
    (-1.0, math.tau, "one of omega_rad_s and heading_rad has the other sign: both count counter-clockwise"),
    (math.degrees(1.0), 360.0, "heading_rad is in degrees"),
)
"""How many times the gyro's turn the headings' is, after what a heading repeats, and what that means."""


def why_nothing(accounts: Sequence[FixOutcome]) -> str:
    """Return why no estimate began, in words.

    Args:
        accounts: Of all fixes.
    """
    begins = "an estimate begins with two fixes that agree"
    reasons = Counter(account.reason for account in accounts)
    if not reasons:
        return f"{begins}, and there is none"
    reason, count = reasons.most_common(1)[0]
    return f"{begins}, and {count} of {len(accounts)} fixes: {reason}"


def likely_cause(data: FlightData, lost: Sequence[tuple[float, float]]) -> str | None:
    """Return what packets and fixes contradict each other by, a sentence; None if nothing shows it.

    Args:
        data: A flight in which an estimator was lost.
        lost: From when to when, s.
    """
    data = data.screened()
    cause = contradiction_of_turns(data)
    if cause is not None or len(lost) < MANY_LOST:
        return cause
    holes = np.diff(data.imu[np.isfinite(data.imu[:, 0]), 0]) > LONG_GAP_S
    if holes.sum() >= len(lost) // 2:
        return None
    return (
        f"the estimate was lost {len(lost)} times: the packets do not explain the fixes; see whether units, "
        "signs and axes of imu.csv and stars.csv are those that are expected, and their clocks one"
    )


def contradiction_of_turns(data: FlightData) -> str | None:
    """Return why the vehicle cannot have turned as its gyro and as its fixes tell; None if it can.

    Args:
        data: Any flight; of little turning nothing is concluded.
    """
    data = data.screened()
    packets = data.imu[np.isfinite(data.imu[:, :2]).all(axis=1)]
    fixes = data.stars[np.isfinite(data.stars).all(axis=1)]
    fixes = fixes[np.argsort(fixes[:, 0], kind="stable")]
    if len(packets) < 2 or len(fixes) <= LEAST_PAIRS:
        return None
    steps = np.diff(packets[:, 0])
    angle = np.concatenate([[0.0], np.cumsum(np.clip(packets[1:, 1], -10.0, 10.0) * steps)])
    turns = _Turns(packets[:, 0], angle, fixes)
    sigma = math.sqrt(2.0) * data.noise.star_sigma_heading_rad
    base = turns.scatter(1.0, 0.0)
    if not base > max(CONTRADICTED_SIGMAS * sigma, SCALE_ERROR * turns.turned):
        return None
    if not turns.turned > TURNED_SIGMAS * sigma:
        return "the headings turn and the gyro does not: are imu.csv and stars.csv of one flight, in rad"
    for scale, whole, words in SCALES:
        if turns.scatter(scale, 0.0, whole) < BETTER * base:
            return f"the headings turn {scale:.3g} times as far as the gyro: {words}"
    lags = np.arange(-FARTHEST_S, FARTHEST_S + LAG_STEP_S, LAG_STEP_S)
    left = np.array([turns.scatter(1.0, lag) for lag in lags.tolist()])
    best = int(np.nanargmin(left))
    if left[best] < BETTER * base and abs(lags[best]) > LEAST_LAG_S:
        side = "earlier" if lags[best] < 0.0 else "later"
        return (
            f"the fixes fit the packets if they were exposed {abs(lags[best]):.1f} s {side}: stars.csv and "
            "imu.csv are stamped by two clocks, or the delay that was taken off the arrivals is wrong"
        )
    return (
        "the headings do not turn as the gyro does, by no sign, unit or clock: are imu.csv and stars.csv of "
        "one flight"
    )


class _Turns:
    """How far a vehicle turned from fix to fix, by its fixes and by its gyro."""

    def __init__(self, packet_s: Array, angle_rad: Array, fixes: Array) -> None:
        self._packet_s, self._angle_rad = packet_s, angle_rad
        first = np.tile(np.arange(len(fixes)), len(APART_S))
        wanted_s = fixes[first, 0] + np.repeat(APART_S, len(fixes))
        second = np.minimum(np.searchsorted(fixes[:, 0], wanted_s, side="right"), len(fixes) - 1)
        gap_s = fixes[second, 0] - fixes[first, 0]
        pairs = (gap_s > 0.0) & (gap_s < LONGEST_PAIR_S)
        self._from_s, self._gap_s = fixes[first, 0][pairs], gap_s[pairs]
        self._seen = (fixes[second, 4] - fixes[first, 4])[pairs]
        self.turned = _scatter(self._by_gyro(0.0), self._gap_s) if len(gap_s) else 0.0

    def scatter(self, scale: float, lag_s: float, whole: float = math.tau) -> float:
        """What is left of the turns if the gyro's are scaled and the exposures so much later."""
        left = self._seen - scale * self._by_gyro(lag_s)
        left -= whole * np.round(left / whole)
        is_in = self._inside(lag_s)
        return _scatter(left[is_in], self._gap_s[is_in]) if is_in.sum() >= LEAST_PAIRS else math.nan

    def _by_gyro(self, lag_s: float) -> Array:
        begin = np.interp(self._from_s + lag_s, self._packet_s, self._angle_rad)
        end = np.interp(self._from_s + self._gap_s + lag_s, self._packet_s, self._angle_rad)
        return np.asarray(end - begin)

    def _inside(self, lag_s: float) -> NDArray[np.bool_]:
        begin_s = self._from_s + lag_s
        return np.asarray((begin_s >= self._packet_s[0]) & (begin_s + self._gap_s <= self._packet_s[-1]))


def _scatter(turns_rad: Array, gap_s: Array) -> float:
    """Mean size of the turns but for the gyro's zero, of the most that lie together, rad."""
    off = np.sort(np.abs(turns_rad - np.median(turns_rad / gap_s) * gap_s))
    return float(off[: max(1, round(KEPT * len(off)))].mean())
