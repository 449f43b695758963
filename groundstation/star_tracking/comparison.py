"""Two sources of fixes against each other: the referee of both.

Neither is the truth. Where both are as good as they say, the difference divided by its covariance, squared,
is 3 in the mean; the mean of many differences shows what they disagree on. Which of the two is wrong cannot
be told from two: that takes a tape, or the marks on the table.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WINDOW = 60
"""Pairs that a verdict looks back on."""
MIN_PAIRS = 8
FALSE_ALARM_SIGMA = 5.0
"""A verdict is given with every pair: it must not cry wolf in an hour of them."""
_AXES = ("x", "y", "heading")
_DEGREES_OF_FREEDOM = 3


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the last pairs say.

    Attributes:
        pairs: How many they are.
        mean_difference: First minus second source: x, y (m), heading (rad).
        mean_nis: Mean normalised difference squared; 3 where both are as good as they say.
        word: ``too few``, ``agree`` or ``disagree``.
        reason: What they disagree on; empty otherwise.
    """

    pairs: int
    mean_difference: tuple[float, float, float]
    mean_nis: float
    word: str
    reason: str


class Referee:
    """Judges the last pairs of fixes of one vehicle."""

    def __init__(self) -> None:
        self._pairs: deque[tuple[Array, Array, float]] = deque(maxlen=WINDOW)

    def judge(self, difference: Array, covariance: Array) -> tuple[float, Verdict]:
        """Take one pair.

        Args:
            difference: First source minus second at one moment: x, y (m), heading (rad, wrapped), shape (3,).
            covariance: Of the difference, (3, 3).

        Returns:
            The pair's normalised difference squared, and the verdict over the last pairs.
        """
        nis = float(difference @ np.linalg.solve(covariance, difference))
        self._pairs.append((difference, np.diag(covariance), nis))
        return nis, verdict_of(list(self._pairs))


def verdict_of(pairs: list[tuple[Array, Array, float]]) -> Verdict:
    """Judge pairs of (difference, variances, nis)."""
    count = len(pairs)
    differences = np.array([pair[0] for pair in pairs])
    mean = differences.mean(axis=0)
    mean_nis = float(np.mean([pair[2] for pair in pairs]))
    word, reason = "agree", ""
    # chi-square of 3n degrees of freedom has the variance 6n
    limit = _DEGREES_OF_FREEDOM + FALSE_ALARM_SIGMA * math.sqrt(2.0 * _DEGREES_OF_FREEDOM / count)
    if count < MIN_PAIRS:
        word = "too few"
    elif mean_nis > limit:
        word, reason = "disagree", _what(mean, np.array([pair[1] for pair in pairs]), differences)
    return Verdict(count, (float(mean[0]), float(mean[1]), float(mean[2])), mean_nis, word, reason)


def _what(mean: Array, variances: Array, differences: Array) -> str:
    """Name the axis that is worst against what the sources say of themselves, and how it differs."""
    sigma = np.sqrt(variances.mean(axis=0))
    rms = np.sqrt((differences**2).mean(axis=0))
    axis = int(np.argmax(rms / sigma))
    unit, scale = ("deg", math.degrees(1.0)) if axis == len(_AXES) - 1 else ("mm", 1e3)
    share = f"{rms[axis] / sigma[axis]:.1f} times what they say"
    if abs(mean[axis]) > 0.7 * rms[axis]:
        return f"{_AXES[axis]} by {scale * mean[axis]:+.2f} {unit} ({share})"
    return f"{_AXES[axis]} scatters by {scale * rms[axis]:.2f} {unit} ({share})"
