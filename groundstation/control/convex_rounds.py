"""Sequential convex programming: rounds of a quadratic programme, each around the ways of the last.

The integral of the accelerations' squares is least. Keeping apart is not convex: in each round every pair
has to stay on its own side of the line across the one that joined it in the round before (F. Augugliaro, A.
Schoellig, R. D'Andrea, Generation of collision-free trajectories for a quadrocopter fleet: a sequential
convex programming approach, IEEE/RSJ Int. Conf. Intelligent Robots and Systems, 2012). One slack for all of
them lets early rounds be too near; it costs far more than any detour. Speed and acceleration stay within a
polygon inside their circle. The programmes are solved by PIQP (R. Schwan and others, PIQP: A Proximal
Interior-Point Quadratic Programming Solver, IEEE Conf. Decision and Control, 2023).
"""

import itertools
import math

import numpy as np
import piqp
from numpy.typing import NDArray
from scipy import sparse

from groundstation.control.spline import ENDS, Array, RestToRest
from groundstation.control.trajectories import Reconfiguration

_SAMPLES_A_SPAN = 4
_SIDES = 12
_LEEWAY_M = 0.008  # asked for beyond the margins, for what lies between the samples
_NEAR_M = 0.5  # a pair that has more room than this is left out of a round
_SLACK_COST = 1e3
_APART_M = 1e-6  # two ships on one spot: any direction will do


class Rounds:
    """The programme of one reconfiguration.

    Args:
        asked: From where to where.
        family: Of the splines.
    """

    def __init__(self, asked: Reconfiguration, family: RestToRest) -> None:
        self._asked, self._family = asked, family
        self._ships, self._free = len(asked.starts_m), family.count - 2 * ENDS
        self._size = 2 * self._ships * self._free + 1
        samples = _SAMPLES_A_SPAN * family.spans
        t_s = np.linspace(0.0, family.duration_s, samples + 1)
        self._place, self._speed = family.basis(t_s), family.basis(t_s, 1)
        starts, goals = np.array(asked.starts_m, float), np.array(asked.goals_m, float)
        self._fixed_m = np.zeros((self._ships, family.count, 2))
        self._fixed_m[:, :ENDS], self._fixed_m[:, -ENDS:] = starts[:, None], goals[:, None]
        scale = 1.0 / (asked.margins.acceleration_m_s2**2 * family.duration_s)
        effort = scale * family.effort()
        self._cost = sparse.block_diag(
            [*[effort[ENDS:-ENDS, ENDS:-ENDS]] * (2 * self._ships), [[1e-9]]], format="csc"
        )
        by_ends = np.einsum("jk,ska->saj", effort[ENDS:-ENDS], self._fixed_m)
        self._linear = np.append(by_ends.ravel(), _SLACK_COST)
        self._always, self._bound = self._limits()
        self._rows: list[Array] = []
        self._bounds: list[Array] = []

    def solved(self, around_m: Array) -> tuple[Array, float] | None:
        """The next round.

        Args:
            around_m: Control points of the last one, shape (ships, count, 2).

        Returns:
            New control points and what is missing of the room (m); None where the solver gave up.
        """
        rows, bounds = self._apart(around_m)
        matrix = sparse.vstack([self._always, sparse.csc_matrix(rows)], format="csc")
        solver = piqp.SparseSolver()
        lowest = np.full(self._size, -np.inf)
        lowest[-1] = 0.0
        solver.setup(
            self._cost, self._linear, None, None, matrix, None, np.append(self._bound, bounds), lowest, None
        )
        if solver.solve() != piqp.PIQP_SOLVED:
            return None
        found = np.asarray(solver.result.x)
        made_m = self._fixed_m.copy()
        made_m[:, ENDS:-ENDS] = np.moveaxis(found[:-1].reshape(self._ships, 2, self._free), 1, 2)
        return made_m, float(found[-1])

    def _limits(self) -> tuple[sparse.csc_matrix, Array]:
        """Rows that every round has: speed, acceleration and region of the control points."""
        margins, family, keep_in = self._asked.margins, self._family, self._asked.keep_in
        angles = math.tau / _SIDES * np.arange(_SIDES)
        sides = np.column_stack([np.cos(angles), np.sin(angles)])
        inner = math.cos(math.pi / _SIDES)
        kinds = [
            (sides, family.derivative(1), np.full(_SIDES, margins.speed_m_s * inner)),
            (sides, family.derivative(2), np.full(_SIDES, margins.acceleration_m_s2 * inner)),
        ]
        if keep_in is not None:
            normals = np.array([normal for normal, _ in keep_in.inward()])
            kinds.append(
                (-normals, np.eye(family.count), np.array([offset for _, offset in keep_in.inward()]))
            )
        blocks, bounds = [], []
        for ship in range(self._ships):
            block, bound = [], []
            for directions, operator, limit in kinds:
                # two columns of values, one an axis: rows are directions times control points
                block.append(np.kron(directions, operator[:, ENDS:-ENDS]))
                at_ends = (operator @ self._fixed_m[ship]) @ directions.T
                bound.append((limit - at_ends).T.ravel())
            rows, limits = np.vstack(block), np.concatenate(bound)
            matters = np.abs(rows).max(axis=1) > 0.0
            blocks.append(rows[matters])
            bounds.append(limits[matters])
        matrix = sparse.block_diag(blocks, format="csc")
        slack = sparse.csc_matrix((matrix.shape[0], 1))
        return sparse.hstack([matrix, slack], format="csc"), np.concatenate(bounds)

    def _apart(self, around_m: Array) -> tuple[Array, Array]:
        """Rows of a round: pairs, obstacles and edges that are near, at every sample.

        Twice each: where the ships are, and where they would come to rest, which is along the velocity by the
        time that stopping takes.
        """
        margins, self._rows, self._bounds = self._asked.margins, [], []
        at, velocity = self._along(self._place, around_m), self._along(self._speed, around_m)
        speeds_m_s = np.hypot(velocity[..., 0], velocity[..., 1])
        stopping_s = margins.reaction_s + speeds_m_s / (2.0 * margins.braking_m_s2)
        still = np.zeros_like(stopping_s[0])
        for one, other in itertools.combinations(range(self._ships), 2):
            unit, apart_m = _units(at[one] - at[other])
            near = apart_m < 2.0 * margins.radius_m + margins.gap_m + _NEAR_M
            self._keep(
                unit, near, 2.0 * margins.radius_m + margins.gap_m, [(one, 1.0, still), (other, -1.0, still)]
            )
            towards, theirs = -(velocity[one] * unit).sum(axis=1), (velocity[other] * unit).sum(axis=1)
            stops = [
                (one, 1.0, np.where(towards > 0.0, stopping_s[one], 0.0)),
                (other, -1.0, np.where(theirs > 0.0, stopping_s[other], 0.0)),
            ]
            least_m = 2.0 * margins.radius_m + margins.stopping_gap_m
            self._keep(unit, towards + theirs > 0.0, least_m, stops)
        for ship in range(self._ships):
            for x, y, radius in self._asked.obstacles_m:
                unit, apart_m = _units(at[ship] - (x, y))
                touching_m = unit @ (x, y) + margins.radius_m + radius
                near = apart_m < margins.radius_m + radius + margins.gap_m + _NEAR_M
                self._keep(unit, near, touching_m + margins.gap_m, [(ship, 1.0, still)])
                closing = (velocity[ship] * unit).sum(axis=1) < 0.0
                self._keep(
                    unit, closing, touching_m + margins.stopping_gap_m, [(ship, 1.0, stopping_s[ship])]
                )
            for normal, offset in self._asked.keep_in.inward() if self._asked.keep_in is not None else ():
                unit, closing = np.tile(normal, (len(still), 1)), velocity[ship] @ normal < 0.0
                self._keep(unit, closing, margins.edge_gap_m - offset, [(ship, 1.0, stopping_s[ship])])
        if not self._rows:
            return np.zeros((0, self._size)), np.zeros(0)
        return np.vstack(self._rows), np.concatenate(self._bounds)

    def _keep(
        self,
        unit: Array,
        where: NDArray[np.bool_],
        least_m: float | Array,
        ships: list[tuple[int, float, Array]],
    ) -> None:
        """Rows for unit . (signed sum of the ships' places) + slack >= least + leeway, as upper bounds.

        Args:
            unit: Shape (n, 2).
            where: Samples that count.
            least_m: What is asked for, one or shape (n,).
            ships: Number, sign, and the span (s) along its velocity by which its place is carried on.
        """
        if not where.any():
            return
        unit, least = unit[where], np.broadcast_to(least_m, where.shape)[where]
        made, held = np.zeros((len(unit), self._size)), np.zeros(len(unit))
        for ship, sign, span_s in ships:
            basis = self._place[where] + span_s[where][:, None] * self._speed[where]
            for axis in (0, 1):
                begin = (2 * ship + axis) * self._free
                made[:, begin : begin + self._free] = -sign * unit[:, axis : axis + 1] * basis[:, ENDS:-ENDS]
                held += sign * unit[:, axis] * (basis @ self._fixed_m[ship, :, axis])
        moves = np.abs(made).max(axis=1) > 0.0
        made[:, -1] = -1.0
        self._rows.append(made[moves])
        self._bounds.append((held - least - _LEEWAY_M)[moves])

    @staticmethod
    def _along(basis: Array, control_m: Array) -> Array:
        """Values at the samples, shape (ships, n, 2)."""
        values: Array = np.einsum("nk,ska->sna", basis, control_m)
        return values


def _units(way: Array) -> tuple[Array, Array]:
    apart_m = np.hypot(way[:, 0], way[:, 1])
    unit = np.where(apart_m[:, None] > _APART_M, way / np.maximum(apart_m, _APART_M)[:, None], (1.0, 0.0))
    return unit, apart_m
