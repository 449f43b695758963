"""The part of the table that a mock-up may use: a convex region, distances to its edges, nearest point."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from groundstation.control.state import Vector2


@dataclass(frozen=True, slots=True)
class KeepIn:
    """A convex region of the table.

    Args:
        corners_table_m: Corners in counter-clockwise order, at least three.

    Raises:
        ValueError: Fewer than three corners, clockwise order, or a corner that is not convex.
    """

    corners_table_m: tuple[Vector2, ...]
    _inward: tuple[tuple[Vector2, float], ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        corners = self.corners_table_m
        if len(corners) < 3:
            raise ValueError(f"a keep-in region needs at least three corners, found {len(corners)}")
        for index, corner in enumerate(corners):
            before, after = corners[index - 1], corners[(index + 1) % len(corners)]
            turn = (corner[0] - before[0]) * (after[1] - corner[1])
            turn -= (corner[1] - before[1]) * (after[0] - corner[0])
            if not turn > 0.0:
                raise ValueError(
                    f"a keep-in region must be convex and counter-clockwise; corner {corner} is not"
                )
        object.__setattr__(self, "_inward", tuple(_line(a, b) for a, b in self._edges()))

    def edge_distances_m(self, position_table_m: Vector2) -> list[float]:
        """Distance to each edge line, positive inside, in the order of the corners."""
        return [
            normal[0] * position_table_m[0] + normal[1] * position_table_m[1] + offset
            for normal, offset in self._inward
        ]

    def nearest_inside(self, position_table_m: Vector2) -> Vector2:
        """The position itself, or the nearest one of the region."""
        if min(self.edge_distances_m(position_table_m)) >= 0.0:
            return position_table_m
        candidates = [_nearest_on(a, b, position_table_m) for a, b in self._edges()]
        return min(candidates, key=lambda point: math.dist(point, position_table_m))

    def _edges(self) -> list[tuple[Vector2, Vector2]]:
        return list(itertools.pairwise((*self.corners_table_m, self.corners_table_m[0])))

    def inward(self) -> tuple[tuple[Vector2, float], ...]:
        """Unit normal n and offset c of each edge: n . p + c is the distance inside."""
        return self._inward


def rectangle(
    size_table_m: Vector2, *, margin_m: float = 0.0, centre_table_m: Vector2 = (0.0, 0.0)
) -> KeepIn:
    """A table of the given size, less a margin all round (the mock-up's own radius and more).

    Raises:
        ValueError: The margin leaves nothing.
    """
    half_x, half_y = size_table_m[0] / 2.0 - margin_m, size_table_m[1] / 2.0 - margin_m
    if not (half_x > 0.0 and half_y > 0.0):
        raise ValueError(f"a margin of {margin_m} m leaves nothing of a table of {size_table_m} m")
    x, y = centre_table_m
    signs: Sequence[Vector2] = ((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
    return KeepIn(tuple((x + side_x * half_x, y + side_y * half_y) for side_x, side_y in signs))


def _line(a: Vector2, b: Vector2) -> tuple[Vector2, float]:
    length = math.dist(a, b)
    normal = ((a[1] - b[1]) / length, (b[0] - a[0]) / length)
    return normal, -normal[0] * a[0] - normal[1] * a[1]


def _nearest_on(a: Vector2, b: Vector2, point: Vector2) -> Vector2:
    along = (b[0] - a[0], b[1] - a[1])
    share = ((point[0] - a[0]) * along[0] + (point[1] - a[1]) * along[1]) / (along[0] ** 2 + along[1] ** 2)
    share = min(max(share, 0.0), 1.0)
    return a[0] + share * along[0], a[1] + share * along[1]
