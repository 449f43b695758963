"""Thruster allocation: a wrench becomes the share of time that each valve is open, for the least gas.

Gas flows in proportion to thrust. Least gas is a linear programme: minimise sum(flow u) subject to
B u = w - b and 0 <= u <= 1, with b what valves give that do not shut. An optimum lies at a basic solution:
three valves partly open, every other one shut or fully open. Which of the two follows from the sign of its
reduced cost flow - y . column, where y = B_basis^-T flow_basis prices the wrench (D. Bertsimas,
J. Tsitsiklis, Introduction to Linear Optimization, 1997, sections 3.1 and 3.3). The prices do not depend on
the demand, so all candidates are made once; for a demand, every candidate whose three duties come out within
0 and 1 is optimal. No solver and no iteration: one matrix product, the same time for every demand.

Nor do the prices depend on how strong a valve is, since gas and thrust scale alike. So a plan for valves that
became weak is a plan for healthy ones with other duties, and where one is left out, those without it remain:
planning anew sorts candidates and makes none.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.control.state import BodyWrench
from groundstation.control.valve_health import HEALTHY, ValveHealth, shares
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope

MAX_VALVES = 12  # candidates grow as n^3 times the ties of a symmetric layout
_SLACK = 1e-9  # duty below 0 or above 1 that is rounding
_TIE = 1e-9  # reduced cost, over flow, that is zero
_SINGULAR = 1e-6  # volume spanned by the columns of a basis, each of length one

Floats = NDArray[np.float64]


class Allocator:
    """Shares a wrench among the valves of one vehicle.

    Args:
        vehicle: Where the valves push.
        health: Of each valve; without it all are healthy.

    Attributes:
        envelope: What the valves can make.
        effectiveness: Shape (3, n): force x [N], force y [N], torque [N m] that a command to open adds, body
            axes; zero for valves that do not obey.
        offset: Shape (3,): what valves give that do not shut.
        flow: Shape (n,): gas that a command to open adds, one for a healthy valve of mean thrust.
        idle_flow: Gas of valves that do not shut, likewise.
        obeys: Of each valve, whether commands make a difference; others are never commanded to open.
        open_shares, shut_shares: Of the rig's thrust, what each valve is taken to give.

    Raises:
        ValueError: Healthy valves cannot make every wrench, there are more than `MAX_VALVES`, or not as many
            states of health as valves. What broken valves leave is never refused: see `envelope`.
    """

    def __init__(self, vehicle: VehicleModel, health: Sequence[ValveHealth] | None = None) -> None:
        count = len(vehicle.valves)
        if count > MAX_VALVES:
            raise ValueError(f"allocation handles at most {MAX_VALVES} valves, found {count}")
        WrenchEnvelope(vehicle)  # refuses what even healthy valves cannot fly
        self._vehicle = vehicle
        self._thrust = np.array([valve.thrust_n for valve in vehicle.valves])
        self._all_plans = _plans(vehicle.effectiveness() / self._thrust, np.arange(count), 3)
        self._take(health)

    def with_health(self, health: Sequence[ValveHealth] | None) -> "Allocator":
        """The same vehicle's for other states of its valves: for eight valves made in half a millisecond."""
        other = object.__new__(Allocator)
        other._vehicle, other._thrust, other._all_plans = self._vehicle, self._thrust, self._all_plans
        other._take(health)
        return other

    def _take(self, health: Sequence[ValveHealth] | None) -> None:
        vehicle = self._vehicle
        count = len(vehicle.valves)
        states = [HEALTHY] * count if health is None else health
        added, idle = shares(states, count)
        self.envelope = WrenchEnvelope(vehicle, health)
        self.obeys = tuple(valve.obeys for valve in states)
        self.open_shares = (added + idle).tolist()
        self.shut_shares = idle.tolist()
        columns = vehicle.effectiveness()
        self.effectiveness: Floats = columns * added
        self.offset: Floats = columns @ idle
        mean_n = float(self._thrust.mean())
        self.flow: Floats = self._thrust * added / mean_n
        self.idle_flow = float(self._thrust @ idle) / mean_n
        plans = self._all_plans.without(added <= 0.0)
        if not len(plans.basis):  # what is left spans less than all wrenches
            plans = _plans(columns / self._thrust, np.flatnonzero(added > 0.0), self.envelope.dimension)
        pushes = (self._thrust * added)[plans.basis]
        solve = plans.inverse / pushes[:, :, None]
        self._relief = np.einsum("mij,jm->mi", solve, self.effectiveness @ plans.fixed.T)
        self._solve = solve.reshape(-1, 3)
        self._basis, self._fixed = plans.basis, plans.fixed
        self._fixed_count = plans.fixed.sum(axis=1)

    def allocate(self, wrench: BodyWrench, *, sparse: bool = False) -> Floats:
        """Duties that make the wrench (shortened by the envelope where it must be) with the least gas.

        Args:
            wrench: Demand, body axes.
            sparse: One plan of as few valves as possible, for pulses that have a least length; otherwise the
                mean of all plans that burn least, which treats symmetric valves alike.

        Returns:
            Shape (n,), each within [0, 1]: mean share of time open; 0 for valves that do not obey.
        """
        makeable = self.envelope.saturate(wrench)
        demand = np.array((*makeable.force_body_n, makeable.torque_nm)) - self.offset
        partial = (self._solve @ demand).reshape(self._relief.shape) - self._relief
        miss = np.abs(partial - 0.5).max(axis=1, initial=0.5) - 0.5
        # on the envelope's very surface all candidates miss by rounding: the least miss then counts as none
        optimal = np.flatnonzero(miss <= max(_SLACK, float(miss.min()) + _SLACK))
        if sparse:
            used = (partial[optimal] > _SLACK).sum(axis=1) + self._fixed_count[optimal]
            fewest = optimal[used.argmin()]
            plan: Floats = self._fixed[fewest].copy()
            plan[self._basis[fewest]] = partial[fewest]
            return plan.clip(0.0, 1.0)
        duties = self._fixed[optimal]
        duties[np.arange(len(optimal))[:, None], self._basis[optimal]] = partial[optimal]
        mean: Floats = duties.sum(axis=0) / len(optimal)
        return mean.clip(0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Plans:
    """Basic solutions that are optimal wherever they are feasible, for valves that all push with 1 N.

    Attributes:
        basis: (m, r) valves that are partly open; r is the dimension of what the valves can make.
        inverse: (m, r, 3) from a wrench to their thrusts.
        fixed: (m, n) duties of the others, 0 or 1.
    """

    basis: NDArray[np.intp]
    inverse: Floats
    fixed: Floats

    def without(self, is_out: NDArray[np.bool_]) -> "_Plans":
        """Those that do not lean on valves which are out."""
        if not is_out.any():
            return self
        kept = ~is_out[self.basis].any(axis=1)
        basis, fixed = self.basis[kept], np.where(is_out, 0.0, self.fixed[kept])
        # two that differed by a valve which is out have become the same
        _, first = np.unique(np.hstack([basis, fixed]), axis=0, return_index=True)
        first.sort()
        return _Plans(basis[first], self.inverse[kept][first], fixed[first])


def _plans(unit: Floats, valves: NDArray[np.intp], rank: int) -> _Plans:
    """All plans of some valves, given the wrench (3, n) of each of all at 1 N and the rank of those taken."""
    count = unit.shape[1]
    basis = np.array(list(itertools.combinations(valves.tolist(), rank)), dtype=np.intp)
    columns = unit[:, basis].transpose(1, 0, 2)
    shape = columns / np.linalg.norm(columns, axis=1, keepdims=True)
    volume = np.sqrt(np.maximum(0.0, np.linalg.det(shape.transpose(0, 2, 1) @ shape)))
    kept = volume > min(_SINGULAR, 0.5 * float(volume.max()))
    basis, columns = basis[kept], columns[kept]
    inverse = np.linalg.pinv(columns)
    reduced_cost = 1.0 - inverse.sum(axis=1) @ unit
    np.put_along_axis(reduced_cost, basis, np.inf, axis=1)  # decided by the demand, not by its price
    reduced_cost[:, np.setdiff1d(np.arange(count), valves)] = np.inf
    rows: list[int] = []
    fixed: list[Floats] = []
    for row, costs in enumerate(reduced_cost):
        undecided = np.flatnonzero(np.abs(costs) <= _TIE)
        for choice in itertools.product((0.0, 1.0), repeat=len(undecided)):
            duties = np.where(costs < 0.0, 1.0, 0.0)
            duties[undecided] = choice
            rows.append(row)
            fixed.append(duties)
    return _Plans(basis[rows], inverse[rows], np.reshape(fixed, (-1, count)))
