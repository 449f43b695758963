"""Numbers of a flight that goes on, kept for a picture: few enough to be sent every second."""

from __future__ import annotations

from collections import deque

from groundstation.declarations.guide import Curve, Mark

MOST = 400


class LiveCurve:
    """The newest points of one curve.

    Args:
        name: For the legend.
        mark: As in `Curve`.
        every_s: Points nearer to each other along x are left out.
        most: So many are kept.
    """

    def __init__(self, name: str, mark: Mark = "dots", every_s: float = 0.0, most: int = MOST) -> None:
        self._name, self._mark, self._every_s = name, mark, every_s
        self._points: deque[tuple[float, float]] = deque(maxlen=most)

    def __len__(self) -> int:
        return len(self._points)

    def add(self, x: float, y: float) -> None:
        """Add a point."""
        if not self._points or not self._every_s or abs(x - self._points[-1][0]) >= self._every_s:
            self._points.append((x, y))

    def curve(self) -> Curve:
        """What there is to draw."""
        x, y = zip(*self._points, strict=True) if self._points else ((), ())
        return Curve(self._name, x, y, self._mark)
