"""Strings the pictures of a slow sweep together: rough poses and which spot is which star.

Each picture is laid on the map of those before it: first by triangles on the last few pictures (any
turn, any shift), then on the map itself. What matches no star of the map becomes one.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from groundstation.star_tracking.hypotheses import NEIGHBOUR_RANKS, spot_triangles
from groundstation.star_tracking.sky_index import triangle_key

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

_TRIANGLE_TOLERANCE_M = 0.008
_MIN_COMMON = 6
_LOOK_BACK = 6
_HIDDEN = -1


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """A sweep strung together, in the axes of its first picture.

    Attributes:
        pose: x, y, heading of every placed picture, shape (f, 3).
        placed: Index of the placed pictures among those given, shape (f,).
        star_m: Rough stars as complex numbers, shape (s,).
        frame: Observations: row of ``pose``, shape (m,).
        spot: Observations: spot of that picture, shape (m,).
        star: Observations: row of ``star_m``, shape (m,).
    """

    pose: NDArray[np.float64]
    placed: Index
    star_m: Complex
    frame: Index
    spot: Index
    star: Index


def string_together(pictures: Sequence[Complex]) -> Sweep:
    """Lay pictures on one another.

    Args:
        pictures: Spots on the ceiling in body axes, one complex array per picture, in order.

    Raises:
        ValueError: Fewer than two pictures overlap.
    """
    gate = 0.25 * _median_spacing(pictures)
    star = np.zeros(0, np.complex128)
    seen = np.zeros(0)
    poses: dict[int, tuple[complex, complex]] = {}
    names: dict[int, Index] = {}
    for number, q in enumerate(pictures):
        if len(q) < _MIN_COMMON:
            continue
        if not poses:
            pose: tuple[complex, complex] | None = (1.0 + 0j, 0j)
        else:
            pose = _place(number, q, pictures, poses, star, gate)
        if pose is None:
            continue
        turn, shift = pose
        where = turn * q + shift
        name = _names(where, star, gate)
        known = name != _HIDDEN
        # Running mean of the stars; the adjustment does it properly later.
        star[name[known]] += (where[known] - star[name[known]]) / (seen[name[known]] + 1.0)
        seen[name[known]] += 1.0
        fresh = np.flatnonzero(~known)
        name[fresh] = len(star) + np.arange(len(fresh))
        star = np.concatenate((star, where[fresh]))
        seen = np.concatenate((seen, np.ones(len(fresh))))
        poses[number], names[number] = pose, name
    if len(poses) < 2:
        raise ValueError("no two pictures of the sweep overlap")
    placed = np.array(list(poses), dtype=np.int64)
    turns = np.array([poses[int(i)][0] for i in placed])
    shifts = np.array([poses[int(i)][1] for i in placed])
    lengths = [len(names[int(i)]) for i in placed]
    return Sweep(
        pose=np.stack((shifts.real, shifts.imag, np.angle(turns)), axis=1),
        placed=placed,
        star_m=star,
        frame=np.repeat(np.arange(len(placed)), lengths),
        spot=np.concatenate([np.arange(length) for length in lengths]),
        star=np.concatenate([names[int(i)] for i in placed]),
    )


def rigid_fit(q_m: Complex, goal_m: Complex) -> tuple[complex, complex]:
    """Give turn and shift with goal = turn q + shift in the least-squares sense."""
    q_mean, goal_mean = q_m.mean(), goal_m.mean()
    product = complex(((goal_m - goal_mean) * np.conj(q_m - q_mean)).sum())
    turn = product / abs(product)
    return turn, complex(goal_mean - turn * q_mean)


def overlap(q_m: Complex, other_m: Complex, gate_m: float) -> tuple[complex, complex] | None:
    """Find turn and shift that lay one picture on another, None if they share too little."""
    if min(len(q_m), len(other_m)) < _MIN_COMMON:
        return None
    mine, theirs = spot_triangles(q_m, NEIGHBOUR_RANKS), spot_triangles(other_m, NEIGHBOUR_RANKS)
    my_key = triangle_key(q_m[mine.far] - q_m[mine.pivot], q_m[mine.near] - q_m[mine.pivot])
    their_key = triangle_key(
        other_m[theirs.far] - other_m[theirs.pivot], other_m[theirs.near] - other_m[theirs.pivot]
    )
    pairs = cKDTree(my_key.T).query_ball_tree(cKDTree(their_key.T), _TRIANGLE_TOLERANCE_M, p=np.inf)
    query = np.repeat(np.arange(len(pairs)), [len(p) for p in pairs])
    if len(query) == 0:
        return None
    entry = np.concatenate([np.asarray(p, dtype=np.int64) for p in pairs])
    arm = q_m[mine.far[query]] - q_m[mine.pivot[query]]
    their_arm = other_m[theirs.far[entry]] - other_m[theirs.pivot[entry]]
    turn = their_arm / arm
    turn = turn / np.abs(turn)
    shift = other_m[theirs.pivot[entry]] - turn * q_m[mine.pivot[query]]
    tree = cKDTree(_plane(other_m))
    candidates = (turn[:, None] * q_m + shift[:, None])[:400]
    distance, _ = _nearest(tree, candidates.ravel(), gate_m)
    votes = np.isfinite(distance).reshape(len(candidates), -1).sum(axis=1)
    best = int(np.argmax(votes))
    if votes[best] < _MIN_COMMON:
        return None
    return _settle(q_m, other_m, (complex(turn[best]), complex(shift[best])), gate_m)


def _place(
    number: int,
    q: Complex,
    pictures: Sequence[Complex],
    poses: dict[int, tuple[complex, complex]],
    star: Complex,
    gate: float,
) -> tuple[complex, complex] | None:
    for before in sorted((i for i in poses if i < number), reverse=True)[:_LOOK_BACK]:
        step = overlap(q, pictures[before], gate)
        if step is None:
            continue
        turn, shift = poses[before]
        on_map = _settle(q, star, (turn * step[0], turn * step[1] + shift), gate)
        if on_map is not None:
            return on_map
    return overlap(q, star, gate)


def _settle(
    q: Complex, star: Complex, pose: tuple[complex, complex], gate: float
) -> tuple[complex, complex] | None:
    tree = cKDTree(_plane(star))
    for shrink in (1.0, 0.7, 0.5):
        distance, name = _nearest(tree, pose[0] * q + pose[1], shrink * gate)
        near = np.isfinite(distance)
        if int(near.sum()) < _MIN_COMMON:
            return None
        pose = rigid_fit(q[near], star[name[near]])
    return pose


def _names(where: Complex, star: Complex, gate: float) -> Index:
    """Give each spot its star: one spot per star, the nearest; ``_HIDDEN`` for none."""
    name = np.full(len(where), _HIDDEN, dtype=np.int64)
    if len(star) == 0:
        return name
    distance, nearest = _nearest(cKDTree(_plane(star)), where, gate)
    taken: set[int] = set()
    for spot in np.argsort(distance, kind="stable"):
        if not np.isfinite(distance[spot]):
            break
        if int(nearest[spot]) not in taken:
            name[spot] = nearest[spot]
            taken.add(int(nearest[spot]))
    return name


def _median_spacing(pictures: Sequence[Complex]) -> float:
    spacing = [np.asarray(cKDTree(_plane(q)).query(_plane(q), k=2)[0])[:, 1] for q in pictures if len(q) > 1]
    if not spacing:
        raise ValueError("the pictures of the sweep show no stars")
    return float(np.median(np.concatenate(spacing)))


def _nearest(tree: cKDTree, points: Complex, gate_m: float) -> tuple[NDArray[np.float64], Index]:
    """Give distance (inf beyond the gate) and row of the nearest point of the tree."""
    distance, row = tree.query(_plane(points), distance_upper_bound=gate_m)
    return np.asarray(distance, dtype=np.float64), np.asarray(row, dtype=np.int64)


def _plane(points: Complex) -> NDArray[np.float64]:
    return np.stack((points.real, points.imag), axis=-1)
