"""Lay one constellation on another, or know that they do not belong together.

Equal triangles propose motions; proposals that agree are counted together, and the best are tried. A
motion is believed only if chance could not have done it: the number of coinciding points against the
Poisson distribution of accidental ones, times all proposals tried; and if most of what both should
show coincides, because on a ceiling with LEDs in rows a wrong place matches some stars, too.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import poisson

from calibration.sky.survey.triangles import Triangles, neighbour_triangles
from groundstation.frames import rigid_fit

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

MIN_COMMON = 5
"""Fewer coinciding points are never believed: a motion uses up two."""

_USED_UP = 2
_LOG_CHANCE = math.log(1e-9)  # of one wrong join, over all proposals of a pair
_MIN_SHARED_RATIO = 0.35  # of what both should show; stray and dead lights are the rest
_TRIED = 24
_MAX_PROPOSALS = 6000
_RIVAL_RATIO = 0.75  # another place that explains so much of the best makes the ceiling ambiguous


@dataclass(frozen=True, slots=True, eq=False)
class Constellation:
    """Points with their triangles, and where they would be seen if they were there.

    Attributes:
        point_m: Points, shape (n,).
        triangles: Of the points.
        tree: Of the points.
        view_m: Middles of the pictures that they come from, shape (p,).
    """

    point_m: Complex
    triangles: Triangles
    tree: cKDTree
    view_m: Complex

    @classmethod
    def of(cls, point_m: Complex, view_m: Complex) -> "Constellation":
        """Prepare points for comparison."""
        return cls(point_m, neighbour_triangles(point_m), cKDTree(as_plane(point_m)), view_m)


@dataclass(frozen=True, slots=True, eq=False)
class Join:
    """A believed motion: goal = turn * q + shift.

    Attributes:
        turn: exp(i angle).
        shift_m: Translation.
        mine: Rows of the points that coincide, shape (h,).
        theirs: Rows of their counterparts, shape (h,).
    """

    turn: complex
    shift_m: complex
    mine: Index
    theirs: Index


def find_overlap(mine: Constellation, theirs: Constellation, gate_m: float, reach_m: float) -> Join | None:
    """Find the motion that lays ``mine`` on ``theirs``; None if none can be believed.

    Args:
        mine: What is moved.
        theirs: What stays.
        gate_m: How far two sightings of one star may be apart.
        reach_m: Radius round the middle of a picture inside which it shows every star.
    """
    if min(len(mine.point_m), len(theirs.point_m)) < MIN_COMMON:
        return None
    turns, shifts = _proposals(mine, theirs, gate_m)
    best: Join | None = None
    rivals: list[Join] = []
    for turn, shift in zip(turns.tolist(), shifts.tolist(), strict=True):
        join = settle(mine.point_m, theirs, turn, shift, gate_m)
        if join is None or not is_believable(join, mine, theirs, gate_m, reach_m, len(turns)):
            continue
        rivals.append(join)
        if best is None or len(join.mine) > len(best.mine):
            best = join
    if best is None or any(_is_rival(join, best, mine.point_m, gate_m) for join in rivals):
        return None
    return best


def settle(
    q_m: Complex, theirs: Constellation, turn: complex, shift_m: complex, gate_m: float
) -> Join | None:
    """Refine a motion by the points that it brings together, with a shrinking gate."""
    mine = theirs_row = np.zeros(0, np.int64)
    for gate in (3.0 * gate_m, 1.5 * gate_m, gate_m):
        mine, theirs_row = pair_up(turn * q_m + shift_m, theirs.tree, gate)
        if len(mine) < MIN_COMMON:
            return None
        turn, shift_m = rigid_fit(q_m[mine], theirs.point_m[theirs_row])
    return Join(turn, shift_m, mine, theirs_row)


def is_believable(
    join: Join, mine: Constellation, theirs: Constellation, gate_m: float, reach_m: float, tried: int
) -> bool:
    """Say whether a motion is better than chance and contradicts little of what both show."""
    moved = join.turn * mine.point_m + join.shift_m
    views = join.turn * mine.view_m + join.shift_m
    mine_shared = _count_within(moved, theirs.view_m, reach_m)
    theirs_shared = _count_within(theirs.point_m, views, reach_m)
    hits = len(join.mine)
    if hits < _MIN_SHARED_RATIO * min(mine_shared, theirs_shared):
        return False
    area_m2 = math.pi * reach_m**2
    density_m2 = min(len(theirs.point_m), 2.0 * max(theirs_shared, 1)) / area_m2
    accidental = max(mine_shared, hits) * density_m2 * math.pi * gate_m**2
    log_tail = float(poisson.logsf(hits - _USED_UP - 1, accidental))
    return log_tail + math.log(max(tried, 1)) < _LOG_CHANCE


def pair_up(point_m: Complex, tree: cKDTree, gate_m: float) -> tuple[Index, Index]:
    """Give rows of points and of the tree that are nearest to each other, within the gate."""
    answer = tree.query(as_plane(point_m), distance_upper_bound=gate_m)
    distance, row = np.asarray(answer[0], dtype=np.float64), np.asarray(answer[1], dtype=np.int64)
    mine = np.flatnonzero(np.isfinite(distance))
    mine = mine[np.argsort(distance[mine], kind="stable")]
    _, first = np.unique(row[mine], return_index=True)
    mine = np.sort(mine[first])
    return mine, row[mine]


def as_plane(point_m: Complex) -> NDArray[np.float64]:
    """Give complex numbers as rows of x and y."""
    return np.stack((point_m.real, point_m.imag), axis=-1)


def _proposals(mine: Constellation, theirs: Constellation, gate_m: float) -> tuple[Complex, Complex]:
    """Give the motions on which most pairs of equal triangles agree, best first."""
    ours, other = mine.triangles, theirs.triangles
    none = np.zeros(0, np.complex128)
    if len(ours.corner) == 0 or len(other.corner) == 0:
        return none, none
    found = cKDTree(ours.key_m).sparse_distance_matrix(
        cKDTree(other.key_m), 2.0 * gate_m, p=np.inf, output_type="coo_matrix"
    )
    if found.nnz == 0:
        return none, none
    # A regular ceiling has countless equal triangles: the time stays bounded by taking every so-many-th.
    stride = -(-found.nnz // _MAX_PROPOSALS)
    a, b = ours.corner[found.row[::stride]], other.corner[found.col[::stride]]
    arm = mine.point_m[a[:, 1]] - mine.point_m[a[:, 0]]
    their_arm = theirs.point_m[b[:, 1]] - theirs.point_m[b[:, 0]]
    turn = their_arm / arm
    turn = turn / np.abs(turn)
    middle = mine.point_m.mean()
    # Where the middle of the picture goes: unlike the bare shift it does not swing with the turn.
    goes = theirs.point_m[b].mean(axis=1) + turn * (middle - mine.point_m[a].mean(axis=1))
    cell = 12.0 * gate_m
    place = np.stack((goes.real / cell, goes.imag / cell, np.angle(turn) / 0.06), axis=1)
    tree = cKDTree(place)
    # Each proposal counts those that agree with it; the most agreed are taken, one per neighbourhood.
    agree = tree.query_ball_point(place, 1.0, return_length=True)
    taken: list[int] = []
    for index in np.argsort(-agree, kind="stable").tolist():
        if len(taken) == _TRIED:
            break
        if all(np.max(np.abs(place[index] - place[other_one])) > 1.0 for other_one in taken):
            taken.append(index)
    best = np.array(taken, dtype=np.int64)
    return turn[best], goes[best] - turn[best] * middle


def _is_rival(join: Join, best: Join, q_m: Complex, gate_m: float) -> bool:
    """Say whether another motion explains nearly as much as the best one."""
    apart = np.abs((join.turn - best.turn) * q_m + join.shift_m - best.shift_m)
    return float(apart.mean()) > 6.0 * gate_m and len(join.mine) > _RIVAL_RATIO * len(best.mine)


def _count_within(point_m: Complex, view_m: Complex, reach_m: float) -> int:
    distance, _ = cKDTree(as_plane(view_m)).query(as_plane(point_m), distance_upper_bound=reach_m)
    return int(np.isfinite(distance).sum())
