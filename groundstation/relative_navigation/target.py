"""The other craft as the camera knows it: points on it, its inertia, and what of its shape is ambiguous."""

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_POINTS = 3
MOST_POINTS = 64
FARTHEST_M = 1000.0
PLANAR_SHARE = 0.03
"""Points are taken as coplanar if their thickness is below this share of their extent: the second pose of a
plane is then hardly worse than the true one."""
_REPEATED_SHARE = 1e-6
_SYMMETRY_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class Target:
    """Points of a body, in its own axes.

    Attributes:
        points_body_m: (n, 3).
        inertia_kg_m2: Principal moments (3,) along the body axes; None where nobody knows them. Only their
            ratios count.
        centre_of_mass_body_m: (3,), what the motion models move.

    Raises:
        ValueError: Too few points, repeated ones, all on one line, or an inertia that no body has.
    """

    points_body_m: Floats
    inertia_kg_m2: Floats | None = None
    centre_of_mass_body_m: Floats | None = None

    def __post_init__(self) -> None:
        points = self.points_body_m
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f"points_m must be rows of x, y, z, found the shape {points.shape}")
        if not LEAST_POINTS <= len(points) <= MOST_POINTS:
            raise ValueError(f"points_m holds {len(points)} points, expected {LEAST_POINTS} to {MOST_POINTS}")
        check_points(points, "points_m")
        _check_inertia(self.inertia_kg_m2)

    def __len__(self) -> int:
        return len(self.points_body_m)

    @cached_property
    def _thicknesses_m(self) -> Floats:
        return _thicknesses(self.points_body_m)

    @cached_property
    def is_planar(self) -> bool:
        """Whether the points lie in one plane, or so nearly that the second pose of a plane fits as well."""
        return bool(self._thicknesses_m[2] <= PLANAR_SHARE * self._thicknesses_m[0])

    @cached_property
    def normal_body(self) -> Floats:
        """Unit vector (3,) along which the points are thinnest."""
        spread = self.points_body_m - self.points_body_m.mean(axis=0)
        normal: Floats = np.linalg.svd(spread)[2][2]
        return normal

    @cached_property
    def offset_m(self) -> Floats:
        """Centre of mass (3,) in body axes; the origin if nothing is given."""
        return np.zeros(3) if self.centre_of_mass_body_m is None else self.centre_of_mass_body_m

    @cached_property
    def points_from_mass_m(self) -> Floats:
        """Points (n, 3) in body axes, counted from the centre of mass."""
        return self.points_body_m - self.offset_m

    def are_coplanar(self, chosen: Ints) -> bool:
        """Whether some of the points do not span space: then a lone frame may have two poses."""
        if len(chosen) < 4:
            return True
        key = chosen.tobytes()
        if key not in self._known_planes:
            self._known_planes[key] = self._spans_no_space(chosen)
        return self._known_planes[key]

    @cached_property
    def _known_planes(self) -> dict[bytes, bool]:
        return {}

    def _spans_no_space(self, chosen: Ints) -> bool:
        spread = self.points_body_m[chosen] - self.points_body_m[chosen].mean(axis=0)
        sizes = np.linalg.svd(spread, compute_uv=False)
        return bool(sizes[2] <= PLANAR_SHARE * sizes[0])

    @cached_property
    def symmetries(self) -> tuple[tuple[Floats, Ints], ...]:
        """Turns that map the unlabelled points on themselves, the identity excluded.

        Each is rotation (3, 3), permutation (n,): ``rotation @ (p_i - middle) = p_permutation[i] - middle``.
        """
        middle = self.points_body_m.mean(axis=0)
        points = self.points_body_m - middle
        reach = _SYMMETRY_SHARE * float(self._thicknesses_m[0])
        first, second = _independent_pair(points)
        found: list[tuple[Floats, Ints]] = []
        frame = _frame(points[first], points[second])
        for i, j in itertools.permutations(range(len(points)), 2):
            lengths = np.linalg.norm(points[[i, j]], axis=1) - np.linalg.norm(points[[first, second]], axis=1)
            between = np.linalg.norm(points[i] - points[j]) - np.linalg.norm(points[first] - points[second])
            if max(*np.abs(lengths), abs(between)) > reach:
                continue
            rotation = _frame(points[i], points[j]) @ frame.T
            gaps = np.linalg.norm((points @ rotation.T)[:, None] - points[None], axis=2)
            image = gaps.argmin(axis=1)
            if gaps.min(axis=1).max() > reach or len(set(image.tolist())) < len(points):
                continue
            if np.any(image != np.arange(len(points))):
                found.append((rotation, image.astype(np.int64)))
        return tuple(found)


def check_points(points_body_m: Floats, name: str) -> None:
    """Refuse points (n, 3) whose turn cannot be seen.

    Raises:
        ValueError: They are far away, two are at the same place, or all lie on one line; the message has the
            name.
    """
    if not np.all(np.abs(points_body_m) <= FARTHEST_M):
        raise ValueError(f"{name} must be finite and at most {FARTHEST_M:g} m from the body's origin")
    extent = float(np.ptp(points_body_m, axis=0).max())
    for a, b in itertools.combinations(range(len(points_body_m)), 2):
        if float(np.linalg.norm(points_body_m[a] - points_body_m[b])) <= _REPEATED_SHARE * extent:
            raise ValueError(f"points {a} and {b} of {name} are at the same place")
    thicknesses = _thicknesses(points_body_m)
    if thicknesses[1] <= _SYMMETRY_SHARE * thicknesses[0]:
        raise ValueError(f"{name} lie on one line: no turn about it can be seen")


def _thicknesses(points: Floats) -> Floats:
    """Of a cloud (n, 3) along its own axes, thickest first, (3,)."""
    return np.linalg.svd(points - points.mean(axis=0), compute_uv=False)


def _check_inertia(inertia: Floats | None) -> None:
    if inertia is None:
        return
    if inertia.shape != (3,) or not np.all(np.isfinite(inertia)) or not np.all(inertia > 0.0):
        raise ValueError("inertia must be three principal moments above zero")
    if 2.0 * float(inertia.max()) > float(inertia.sum()) * (1.0 + 1e-9):
        raise ValueError(
            f"inertia {', '.join(f'{x:g}' for x in inertia)} is of no body: one moment is larger than the "
            "other two together"
        )


def _independent_pair(points: Floats) -> tuple[int, int]:
    """Two points that do not lie on one line with the middle, as far from it as can be."""
    size = np.linalg.norm(np.cross(points[:, None], points[None]), axis=2)
    first, second = np.unravel_index(int(size.argmax()), size.shape)
    return int(first), int(second)


def _frame(one: Floats, other: Floats) -> Floats:
    x = one / np.linalg.norm(one)
    z = np.cross(one, other)
    z = z / np.linalg.norm(z)
    return np.stack((x, np.cross(z, x), z), axis=1)
