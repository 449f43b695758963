"""Whether the frames are as far from their predictions as both are said to be wrong.

A motion model that is wrong, as by another inertia than the target's, drags the estimate behind the frames:
by little in each of them, and always to the same side. The noise that the filter learns follows only slowly;
meanwhile the innovations tell, and what they hold too much is the bias that the covariance lacks.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.motion_bank import FrameInformation
from groundstation.relative_navigation.pose import Pose

Floats = NDArray[np.float64]

FREEDOM = 6
MEMORY, FEWEST = 12, 4
"""Frames that are looked at together, at most and at least."""
SIGMAS = 4.0
"""Of the mean of so many squares, beyond which chance does not explain it."""
LEAST_KNOWN = 1e-9
"""Least over largest eigenvalue of a frame's scaled information that determines a pose by itself."""


class Innovations:
    """The last innovations of one filter."""

    def __init__(self) -> None:
        self._squares: deque[float] = deque(maxlen=MEMORY)
        self._misses: deque[Floats] = deque(maxlen=MEMORY)

    def forget(self) -> None:
        """The filter believes something else now."""
        self._squares.clear()
        self._misses.clear()

    def note(self, prior: Pose, covariance: Floats, frame: FrameInformation) -> None:
        """Take a frame before the filter does.

        Args:
            prior: Predicted pose.
            covariance: Of it, (6, 6).
            frame: What the frame says; left out if it does not determine a pose by itself.
        """
        size = np.sqrt(np.diag(frame.information))
        if not float(size.min()) > 0.0:
            return
        values = np.linalg.eigvalsh(frame.information / np.outer(size, size))
        if not values[0] > LEAST_KNOWN * values[-1]:
            return
        own = np.linalg.inv(frame.information)
        miss = frame.pose.minus(prior) + own @ frame.gradient
        self._squares.append(float(miss @ np.linalg.solve(covariance + own, miss)))
        self._misses.append(miss)

    @property
    def are_too_large(self) -> bool:
        """Whether their squares, in sigmas, are larger than chance explains."""
        count = len(self._squares)
        if count < FEWEST:
            return False
        limit = FREEDOM + SIGMAS * math.sqrt(2.0 * FREEDOM / count)
        return sum(self._squares) / count > limit

    @property
    def bias(self) -> Floats:
        """Covariance (6, 6) of what the innovations hold too much; zeros where chance explains them."""
        if not self.are_too_large:
            return np.zeros((FREEDOM, FREEDOM))
        misses = np.array(self._misses)
        share = 1.0 - FREEDOM * len(misses) / sum(self._squares)
        found: Floats = share * (misses.T @ misses) / len(misses)
        return found
