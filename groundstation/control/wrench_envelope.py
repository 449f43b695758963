"""The set of wrenches that valves can make: a zonotope, held as its facets.

Every duty vector 0 <= u <= 1 gives the wrench B u + b, with b what valves give that do not shut. So the set
is the sum of the segments from 0 to each column of B, shifted by b. Its facets are normal to the cross
products of two columns (G. M. Ziegler, Lectures on Polytopes, 1995, section 7.3); along a normal n it reaches
h(n) = n . b + sum of the positive n . column. Where the columns span no volume, directions across them take
part as columns of length zero, so that a flat set has facets, too.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.control.half_planes import nearest_point
from groundstation.control.state import BodyWrench, Vector2, bounded, clamp
from groundstation.control.valve_health import HEALTHY, ValveHealth, shares
from groundstation.control.vehicle import VehicleModel

_PARALLEL = 1e-9  # of unit normals: two columns closer than this span no facet
_FLAT = 1e-6  # of the singular values of columns of length one: the set has no extent there
_TOUCH = 1e-9  # N or N m: rounding of a set that only just reaches a point
_ABSURD = 1e9  # N or N m: products of larger demands could overflow


class WrenchEnvelope:
    """States whether a wrench can be made, and shortens one that cannot.

    Args:
        vehicle: Where the valves push.
        health: Of each valve; without it all are healthy.

    Raises:
        ValueError: Healthy valves cannot push in every direction and turn both ways, or there are not as many
            states of health as valves. What broken ones leave is never refused but described, by `missing`.
    """

    def __init__(self, vehicle: VehicleModel, health: Sequence[ValveHealth] | None = None) -> None:
        columns, count = vehicle.effectiveness(), len(vehicle.valves)
        added, idle = shares([HEALTHY] * count if health is None else health, count)
        offset, columns = columns @ idle, (columns * added)[:, added > 0.0]
        self._normals, self._reach, self.dimension = _facets(columns, offset)
        self._torque_range = (
            float(offset[2] + np.minimum(columns[2], 0.0).sum()),
            float(offset[2] + np.maximum(columns[2], 0.0).sum()),
        )
        self._turn_range = _range(self._normals[:, 2], self._reach)
        low, high = self._turn_range
        self.missing = _missing(self._normals, self._reach, self.dimension)
        """What cannot be made, in words; empty where every wrench can that is small enough."""
        if health is None and self.missing:
            raise ValueError(f"the valves cannot push in every direction and turn both ways: {self.missing}")
        self.can_rest = bool((self._reach >= -_TOUCH).all())
        """Whether the valves can do nothing at all: no wrench is one of those that they can make."""
        self.max_torque_nm = max(0.0, min(high, -low)) if self.can_rest else 0.0
        """Torque that can be made either way with no force."""
        across = np.hypot(self._normals[:, 0], self._normals[:, 1])
        self.max_force_n = _first_hit(across, self._reach) if self.can_rest else 0.0
        """Force that can be made in every direction with no torque."""

    def saturate(self, wrench: BodyWrench) -> BodyWrench:
        """The wrench, shortened where the valves cannot make it; torque is served first.

        Heading goes first because a mock-up that loses its heading pushes in wrong directions; force then
        keeps its direction and gives up length. Where valves that do not shut leave no torque at which the
        force could be zero, torque is served within all that can be made, and of the forces possible beside
        it that nearest to the demand is taken.
        """
        force_x, force_y = bounded(wrench.force_body_n, _ABSURD)
        torque = clamp(wrench.torque_nm, _ABSURD)
        along = self._normals @ (force_x, force_y, torque)
        if (along <= self._reach).all():
            return wrench
        low, high = self._turn_range
        if low > high:
            low, high = self._torque_range
            torque = min(max(torque, low), high)
            return BodyWrench(self._nearest_force((force_x, force_y), torque), torque)
        torque = min(max(torque, low), high)
        left = self._reach - self._normals[:, 2] * torque
        scale = min(1.0, _first_hit(self._normals[:, :2] @ (force_x, force_y), left))
        return BodyWrench((force_x * scale, force_y * scale), torque)

    def contains(self, wrench: BodyWrench, tolerance_n: float = _TOUCH) -> bool:
        """Whether some duties between 0 and 1 make this wrench."""
        along = self._normals @ (*wrench.force_body_n, wrench.torque_nm)
        return bool((along <= self._reach + tolerance_n).all())

    def _nearest_force(self, force_n: Vector2, torque_nm: float) -> Vector2:
        left = self._reach - self._normals[:, 2] * torque_nm
        return nearest_point(force_n, self._normals[:, :2].tolist(), left.tolist())


def _first_hit(slope: NDArray[np.float64], room: NDArray[np.float64]) -> float:
    """How far one can go when each facet comes nearer by `slope` a unit and `room` is left."""
    nearing = slope > _PARALLEL
    if not nearing.any():
        return np.inf
    return max(0.0, float((room[nearing] / slope[nearing]).min()))


def _range(slope: NDArray[np.float64], reach: NDArray[np.float64]) -> tuple[float, float]:
    """From where to where slope x value <= reach holds for all; the first is the larger where nowhere."""
    up, down = slope > _PARALLEL, slope < -_PARALLEL
    if (reach[~(up | down)] < -_TOUCH).any():
        return np.inf, -np.inf
    low, high = float((reach[down] / slope[down]).max()), float((reach[up] / slope[up]).min())
    if high < low <= high + _TOUCH:
        low = high = 0.5 * (low + high)
    return low, high


def _facets(
    columns: NDArray[np.float64], offset: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Outward unit normals (m, 3), reach (m,) and dimension of the shifted zonotope of the columns (3, n)."""
    unit = columns / np.linalg.norm(columns, axis=0)
    axes, lengths, _ = np.linalg.svd(unit)
    extent = int((lengths > _FLAT).sum())
    spanning = np.hstack([unit, axes[:, extent:]]).T
    first, second = np.triu_indices(len(spanning), 1)
    normals = np.cross(spanning[first], spanning[second])
    size = np.linalg.norm(normals, axis=1)
    normals = normals[size > _PARALLEL] / size[size > _PARALLEL, None]
    # rounded only to find those that are the same; adding zero makes -0 the same as 0
    _, kept = np.unique(np.round(np.vstack([normals, -normals]), 9) + 0.0, axis=0, return_index=True)
    normals = np.vstack([normals, -normals])[kept]
    reach: NDArray[np.float64] = normals @ offset + np.maximum(normals @ columns, 0.0).sum(axis=1)
    return normals, reach, extent


def _missing(normals: NDArray[np.float64], reach: NDArray[np.float64], extent: int) -> str:
    if extent < 2:
        return "they all push along one line" if extent else "none of them obeys"
    worst = int(np.argmin(reach))
    if reach[worst] > _PARALLEL:
        return ""
    blind = (np.round(normals[worst], 3) + 0.0).tolist()
    if reach[worst] < -_TOUCH:
        return f"something always pushes against (force x, force y, torque) = {blind}"
    return f"nothing acts along (force x, force y, torque) = {blind}"
