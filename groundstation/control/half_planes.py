"""The nearest point that satisfies some half-plane conditions: a quadratic programme of two unknowns.

With two unknowns an optimum is the wish itself, its foot on one line, or the crossing of two lines (Boyd and
Vandenberghe, Convex Optimization, 2004, section 8.1), so all of them are tried and no solver is needed.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from groundstation.control.state import Vector2

_PARALLEL = 1e-9
_TOLERANCE = 1e-9


class HalfPlane(NamedTuple):
    """Points x with normal . x <= bound.

    Attributes:
        normal: Of any length above 0.
        bound: See there.
        whose: What it is there for, in words.
    """

    normal: Vector2
    bound: float
    whose: str


class Nearest(NamedTuple):
    """The nearest point, and the half-planes at whose edge it lies."""

    point: Vector2
    active: tuple[HalfPlane, ...]


def nearest(wish: Vector2, planes: Sequence[HalfPlane]) -> Nearest | None:
    """The point nearest to a wish that lies in all half-planes; None where there is none.

    Args:
        wish: Where one would like to be.
        planes: The conditions; some tens of them.
    """
    violated = [plane for plane in planes if _excess(plane, wish) > _TOLERANCE]
    if not violated:
        return Nearest(wish, ())
    best: Nearest | None = None
    shortest = math.inf
    for index, plane in enumerate(planes):
        for candidate in _candidates(wish, plane, planes[:index], is_violated=plane in violated):
            distance = math.dist(candidate.point, wish)
            if distance < shortest and all(_excess(other, candidate.point) <= _TOLERANCE for other in planes):
                best, shortest = candidate, distance
    return best


def _candidates(
    wish: Vector2, plane: HalfPlane, others: Sequence[HalfPlane], *, is_violated: bool
) -> list[Nearest]:
    found = []
    (a, b), bound, _ = plane
    if is_violated:
        share = (a * wish[0] + b * wish[1] - bound) / (a * a + b * b)
        found.append(Nearest((wish[0] - share * a, wish[1] - share * b), (plane,)))
    for other in others:
        (c, d), limit, _ = other
        turned = a * d - b * c
        if abs(turned) > _PARALLEL * math.hypot(a, b) * math.hypot(c, d):
            crossing = ((bound * d - b * limit) / turned, (a * limit - bound * c) / turned)
            found.append(Nearest(crossing, (plane, other)))
    return found


def _excess(plane: HalfPlane, point: Vector2) -> float:
    """How far beyond the edge a point lies; negative inside."""
    (a, b), bound, _ = plane
    return (a * point[0] + b * point[1] - bound) / math.hypot(a, b)
