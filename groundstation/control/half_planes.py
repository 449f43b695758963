"""The nearest point that satisfies some half-plane conditions: a quadratic programme of two unknowns.

With two unknowns an optimum is the wish itself, its foot on one line, or the crossing of two lines (Boyd and
Vandenberghe, Convex Optimization, 2004, section 8.1). `nearest` tries all of them and says which conditions
hold it, for some tens of them. `nearest_point` cuts a polygon, for the many facets of what valves can make,
where nobody asks which.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from groundstation.control.state import Vector2

_PARALLEL = 1e-9
_TOLERANCE = 1e-9
_FAR = 1e3
"""Half the side of the square that is cut; forces on a table are far within."""
_SLACK = 1e-10
"""By which half planes are widened, so that rounding does not cut a polygon without width to nothing."""


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


def nearest_point(
    point: Vector2, normals: Iterable[Sequence[float]], reaches: Iterable[float]
) -> tuple[float, float]:
    """Nearest point of all x with normal . x <= reach.

    Args:
        point: Anywhere.
        normals: (x, y) of each half plane, of any length up to one.
        reaches: Of each.

    Raises:
        ValueError: The half planes have no point in common.
    """
    corners: list[Vector2] = [(-_FAR, -_FAR), (_FAR, -_FAR), (_FAR, _FAR), (-_FAR, _FAR)]
    is_inside = True
    for (x, y), reach in zip(normals, reaches, strict=True):
        is_inside = is_inside and x * point[0] + y * point[1] <= reach + _SLACK
        corners = _cut(corners, x, y, reach + _SLACK)
    if is_inside:
        return point
    if not corners:
        raise ValueError("half planes without a common point have none that is nearest")
    edges = zip(corners, corners[1:] + corners[:1], strict=True)
    return min(
        (_nearest_of_edge(point, start, end) for start, end in edges), key=lambda one: math.dist(one, point)
    )


def _cut(corners: list[Vector2], x: float, y: float, reach: float) -> list[Vector2]:
    """Cut off what lies beyond a line (I. Sutherland, G. Hodgman, Commun. ACM 17(1), 1974)."""
    beyond = [x * corner[0] + y * corner[1] - reach for corner in corners]
    kept: list[Vector2] = []
    for index, corner in enumerate(corners):
        before, over_before, over = corners[index - 1], beyond[index - 1], beyond[index]
        if (over > 0.0) != (over_before > 0.0):
            share = over_before / (over_before - over)
            kept.append(
                (
                    before[0] + share * (corner[0] - before[0]),
                    before[1] + share * (corner[1] - before[1]),
                )
            )
        if over <= 0.0:
            kept.append(corner)
    return kept


def _nearest_of_edge(point: Vector2, start: Vector2, end: Vector2) -> Vector2:
    along = (end[0] - start[0], end[1] - start[1])
    squared = along[0] ** 2 + along[1] ** 2
    if squared <= 0.0:
        return start
    share = ((point[0] - start[0]) * along[0] + (point[1] - start[1]) * along[1]) / squared
    share = min(max(share, 0.0), 1.0)
    return start[0] + share * along[0], start[1] + share * along[1]
