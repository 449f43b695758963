"""Thruster allocation: a wrench becomes the share of time that each valve is open, for the least gas.

Least gas is a linear programme: minimise sum(u) subject to B u = w and 0 <= u <= 1. An optimum lies at a
basic solution: three valves partly open, every other one shut or fully open. Which of the two follows from
the sign of its reduced cost 1 - y . b, where y = B_basis^-T 1 prices the wrench (D. Bertsimas, J. Tsitsiklis,
Introduction to Linear Optimization, 1997, sections 3.1 and 3.3). The prices do not depend on the demand, so
all candidates are made once; for a demand, every candidate whose three duties come out within 0 and 1 is
optimal. No solver and no iteration: one matrix product, the same time for every demand.
"""

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from groundstation.control.state import BodyWrench
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope

MAX_VALVES = 12  # candidates grow as n^3 times the ties of a symmetric layout
_SLACK = 1e-9  # duty below 0 or above 1 that is rounding
_TIE = 1e-9  # reduced cost, in duty, that is zero
_SINGULAR = 1e-6  # of the normalised determinant: three valves that span no wrench space


class Allocator:
    """Shares a wrench among the valves of one vehicle.

    Raises:
        ValueError: The valves cannot make every wrench, or there are more than `MAX_VALVES`.
    """

    def __init__(self, vehicle: VehicleModel) -> None:
        count = len(vehicle.valves)
        if count > MAX_VALVES:
            raise ValueError(f"allocation handles at most {MAX_VALVES} valves, found {count}")
        self.envelope = WrenchEnvelope(vehicle)
        self.effectiveness = vehicle.effectiveness()
        """Shape (3, n): force x [N], force y [N], torque [N m] per open valve, body axes."""
        candidates = list(_candidates(self.effectiveness))
        self._basis = np.array([basis for basis, _, _, _ in candidates], dtype=np.intp)
        self._solve = np.concatenate([inverse for _, inverse, _, _ in candidates])
        self._relief = np.array([relief for _, _, _, relief in candidates])
        self._fixed = np.array([fixed for _, _, fixed, _ in candidates])
        self._fixed_count = self._fixed.sum(axis=1)

    def allocate(self, wrench: BodyWrench, *, sparse: bool = False) -> NDArray[np.float64]:
        """Duties that make the wrench (shortened by the envelope where it must be) with the least gas.

        Args:
            wrench: Demand, body axes.
            sparse: One plan of as few valves as possible, for pulses that have a least length; otherwise the
                mean of all plans that burn least, which treats symmetric valves alike.

        Returns:
            Shape (n,), each within [0, 1]: mean share of time open.
        """
        makeable = self.envelope.saturate(wrench)
        demand = np.array((*makeable.force_body_n, makeable.torque_nm))
        partial = (self._solve @ demand).reshape(self._relief.shape) - self._relief
        miss = np.abs(partial - 0.5).max(axis=1) - 0.5
        # on the envelope's very surface all candidates miss by rounding: the least miss then counts as none
        optimal = np.flatnonzero(miss <= max(_SLACK, float(miss.min()) + _SLACK))
        if sparse:
            used = (partial[optimal] > _SLACK).sum(axis=1) + self._fixed_count[optimal]
            fewest = optimal[used.argmin()]
            plan: NDArray[np.float64] = self._fixed[fewest].copy()
            plan[self._basis[fewest]] = partial[fewest]
            return plan.clip(0.0, 1.0)
        duties = self._fixed[optimal]
        duties[np.arange(len(optimal))[:, None], self._basis[optimal]] = partial[optimal]
        mean: NDArray[np.float64] = duties.sum(axis=0) / len(optimal)
        return mean.clip(0.0, 1.0)


def _candidates(
    effectiveness: NDArray[np.float64],
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]]:
    """Basic solutions that are optimal wherever they are feasible.

    Yields:
        The three valves, the inverse of their columns (3, 3), the duties of the others (n,), and what
        those relieve the three of (3,).
    """
    count = effectiveness.shape[1]
    for triple in itertools.combinations(range(count), 3):
        basis = np.array(triple, dtype=np.intp)
        columns = effectiveness[:, basis]
        if abs(np.linalg.det(columns / np.linalg.norm(columns, axis=0))) < _SINGULAR:
            continue
        inverse = np.asarray(np.linalg.inv(columns), dtype=np.float64)
        reduced_cost = 1.0 - inverse.sum(axis=0) @ effectiveness
        reduced_cost[basis] = np.inf  # decided by the demand, not by its price
        undecided = np.flatnonzero(np.abs(reduced_cost) <= _TIE)
        for choice in itertools.product((0.0, 1.0), repeat=len(undecided)):
            fixed = np.where(reduced_cost < 0.0, 1.0, 0.0)
            fixed[undecided] = choice
            yield basis, inverse, fixed, inverse @ (effectiveness @ fixed)
