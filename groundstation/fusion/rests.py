"""When a vehicle stood still: stretches of time, the last of them perhaps still open."""

from __future__ import annotations

import itertools
import math

STEP_S = 1.0
"""Longest stretch of flight over which the local slope is held; an outage is covered in several."""


class Rests:
    """Rests in their order, in s of the estimator's clock."""

    def __init__(self) -> None:
        self._rests: list[tuple[float, float]] = []

    def begin(self, t_s: float) -> bool:
        """Open a rest; False if one is open already."""
        if self._is_open:
            return False
        self._rests.append((t_s, math.inf))
        return True

    def end(self, t_s: float) -> bool:
        """Close the open rest; False if there is none."""
        if not self._is_open:
            return False
        self._rests[-1] = self._rests[-1][0], t_s
        return True

    @property
    def _is_open(self) -> bool:
        return bool(self._rests) and math.isinf(self._rests[-1][1])

    @property
    def newest(self) -> tuple[float, float]:
        """Start and end of the last rest; IndexError if there was none."""
        return self._rests[-1]

    def at(self, t_s: float) -> tuple[float, float] | None:
        """Return the rest that holds this moment."""
        return next((rest for rest in self._rests if rest[0] <= t_s <= rest[1]), None)

    def forget_before(self, t_s: float) -> None:
        """Drop the rests that ended by then."""
        self._rests = [rest for rest in self._rests if rest[1] > t_s]

    def stretches(self, start_s: float, stop_s: float) -> list[tuple[float, float, bool]]:
        """Cut an interval at the ends of rests, and flights into steps; True marks rest."""
        edges = (edge for rest in self._rests for edge in rest)
        cuts = [start_s, *(edge for edge in edges if start_s < edge < stop_s), stop_s]
        out = []
        for a, b in itertools.pairwise(cuts):
            if self.at(0.5 * (a + b)) is not None:
                out.append((a, b, True))
            else:
                n = max(1, math.ceil((b - a) / STEP_S))
                inner = [a + (b - a) * i / n for i in range(n)] + [b]
                out += [(p, q, False) for p, q in itertools.pairwise(inner)]
        return out
