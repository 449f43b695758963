"""The set of wrenches that valves can make: a zonotope, held as its facets.

Every duty vector 0 <= u <= 1 gives the wrench B u, so the set is the sum of the segments from 0 to each
column of B. Its facets are normal to the cross products of two columns (G. M. Ziegler, Lectures on
Polytopes, 1995, section 7.3); along a normal n it reaches h(n) = sum of the positive n . b.
"""

import itertools

import numpy as np
from numpy.typing import NDArray

from groundstation.control.state import BodyWrench, bounded, clamp
from groundstation.control.vehicle import VehicleModel

_PARALLEL = 1e-9  # of unit normals: two columns closer than this span no facet
_ABSURD = 1e9  # N or N m: products of larger demands could overflow


class WrenchEnvelope:
    """States whether a wrench can be made, and shortens one that cannot.

    Raises:
        ValueError: The valves cannot push in every direction and turn both ways.
    """

    def __init__(self, vehicle: VehicleModel) -> None:
        columns = vehicle.effectiveness().T
        self._normals, self._reach = _facets(columns)
        turning = np.abs(self._normals[:, 2])
        self.max_torque_nm = _first_hit(turning, self._reach)
        """Torque that can be made either way with no force."""
        self.max_force_n = _first_hit(np.hypot(self._normals[:, 0], self._normals[:, 1]), self._reach)
        """Force that can be made in every direction with no torque."""

    def saturate(self, wrench: BodyWrench) -> BodyWrench:
        """The wrench, shortened where the valves cannot make it; torque is served first.

        Heading goes first because a mock-up that loses its heading pushes in wrong directions; force then
        keeps its direction and gives up length.
        """
        force_x, force_y = bounded(wrench.force_body_n, _ABSURD)
        torque = clamp(wrench.torque_nm, _ABSURD)
        along = self._normals @ (force_x, force_y, torque)
        if (along <= self._reach).all():
            return wrench
        torque = clamp(torque, self.max_torque_nm)
        left = self._reach - self._normals[:, 2] * torque
        scale = min(1.0, _first_hit(self._normals[:, :2] @ (force_x, force_y), left))
        return BodyWrench((force_x * scale, force_y * scale), torque)

    def contains(self, wrench: BodyWrench, tolerance_n: float = 1e-9) -> bool:
        """Whether some duties between 0 and 1 make this wrench."""
        along = self._normals @ (*wrench.force_body_n, wrench.torque_nm)
        return bool((along <= self._reach + tolerance_n).all())


def _first_hit(slope: NDArray[np.float64], room: NDArray[np.float64]) -> float:
    """How far one can go when each facet comes nearer by `slope` a unit and `room` is left."""
    nearing = slope > _PARALLEL
    if not nearing.any():
        return np.inf
    return max(0.0, float((room[nearing] / slope[nearing]).min()))


def _facets(columns: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Outward unit normals (m, 3) and reach (m,) of the zonotope of the columns (n, 3)."""
    normals: list[NDArray[np.float64]] = []
    for first, second in itertools.combinations(columns, 2):
        normal = np.cross(first, second)
        length = float(np.linalg.norm(normal))
        if length <= _PARALLEL * float(np.linalg.norm(first) * np.linalg.norm(second)):
            continue
        for candidate in (normal / length, -normal / length):
            if not normals or not np.isclose(normals, candidate, atol=_PARALLEL).all(axis=1).any():
                normals.append(candidate)
    if not normals:
        raise ValueError("the valves all push along one line: no plane motion can be controlled with them")
    stacked = np.array(normals)
    reach = np.maximum(stacked @ columns.T, 0.0).sum(axis=1)
    if (reach <= _PARALLEL).any():
        blind = stacked[int(np.argmin(reach))]
        raise ValueError(
            "the valves cannot push in every direction and turn both ways: nothing acts along "
            f"(force x, force y, torque) = {np.round(blind, 3).tolist()}"
        )
    return stacked, reach
