"""Strings the pictures of a sweep together: rough poses, and which spot is which star.

Every picture begins as a map of its own. Each is laid on the pictures just before it, then on the maps
that there are; where it fits two maps, they become one. At the end what is left is tried again, until
nothing joins any more. Usually one map remains. If the sweep had a gap, several do: the pictures do not
say how these lie to each other, and it is not guessed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from calibration.sky.survey.overlap import (
    MIN_COMMON,
    Constellation,
    Join,
    as_plane,
    find_overlap,
    is_believable,
    pair_up,
    settle,
)

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]

_LOOK_BACK = 4
_EDGE_QUANTILE = 0.8  # of the spots' distances from the middle: inside, a picture shows every star


@dataclass(frozen=True, slots=True, eq=False)
class LinkedMap:
    """Pictures that hang together, in the axes of one of them.

    Attributes:
        pose: x, y, heading of every picture, shape (f, 3).
        placed: Indices of these pictures among those given, ascending, shape (f,).
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


@dataclass(slots=True)
class _Map:
    """A map that grows: stars, how often each was seen, and per picture its motion and its names."""

    star_m: Complex
    seen: NDArray[np.float64]
    turn: dict[int, complex] = field(default_factory=dict)
    shift: dict[int, complex] = field(default_factory=dict)
    names: dict[int, Index] = field(default_factory=dict)
    sky: Constellation | None = None


def link(
    pictures: Sequence[Complex], gate_m: float, progress: Callable[[int], None] | None = None
) -> list[LinkedMap]:
    """Lay pictures on one another.

    Args:
        pictures: Spots on the ceiling in body axes, one complex array per picture, in order.
        gate_m: How far two sightings of one star may be apart on the ceiling.
        progress: Called with the index of each picture that was dealt with.

    Returns:
        The maps, the one of most pictures first; pictures with too few spots are in none.
    """
    return _Linker(pictures, gate_m).run(progress)


class _Linker:
    def __init__(self, pictures: Sequence[Complex], gate_m: float) -> None:
        self._pictures = pictures
        self._gate = gate_m
        usable = [q for q in pictures if len(q) >= MIN_COMMON]
        everything = np.concatenate(usable) if usable else np.zeros(0, np.complex128)
        self._middle = complex(everything.mean()) if len(everything) else 0j
        distance = np.abs(everything - self._middle)
        self._reach = float(np.quantile(distance, _EDGE_QUANTILE)) if len(everything) else 1.0
        self._skies = {
            i: Constellation.of(q, np.array([self._middle]))
            for i, q in enumerate(pictures)
            if len(q) >= MIN_COMMON
        }
        self._maps: list[_Map] = []

    def run(self, progress: Callable[[int], None] | None) -> list[LinkedMap]:
        for number in self._skies:
            self._add(number)
            if progress is not None:
                progress(number)
        while self._join_any():
            pass
        self._maps.sort(key=lambda one: (-len(one.turn), min(one.turn)))
        return [_result(one) for one in self._maps]

    def _add(self, number: int) -> None:
        """Put a picture on the map on which it fits, or begin a new one with it."""
        q = self._pictures[number]
        own = _Map(q.copy(), np.ones(len(q)))
        own.turn[number], own.shift[number], own.names[number] = 1.0 + 0j, 0j, np.arange(len(q))
        for before in [i for i in self._skies if i < number][: -_LOOK_BACK - 1 : -1]:
            step = self._overlap(self._skies[number], self._skies[before])
            if step is None:
                continue
            home = next(one for one in self._maps if before in one.turn)
            turn = home.turn[before] * step.turn
            shift = home.turn[before] * step.shift_m + home.shift[before]
            join = settle(q, self._sky(home), turn, shift, self._gate)
            if join is not None and self._fits(join, self._skies[number], self._sky(home)):
                self._merge(home, own, join)
                return
        for home in self._maps:
            found = self._overlap(self._skies[number], self._sky(home))
            if found is not None:
                self._merge(home, own, found)
                return
        self._maps.append(own)

    def _join_any(self) -> bool:
        """Join two maps that overlap; False if none do."""
        order = sorted(self._maps, key=lambda one: -len(one.turn))
        for i, home in enumerate(order):
            for other in order[i + 1 :]:
                found = self._overlap(self._sky(other), self._sky(home))
                if found is not None:
                    self._merge(home, other, found)
                    self._maps = [one for one in self._maps if one is not other]
                    return True
        return False

    def _overlap(self, mine: Constellation, theirs: Constellation) -> Join | None:
        return find_overlap(mine, theirs, self._gate, self._reach)

    def _fits(self, join: Join, mine: Constellation, theirs: Constellation) -> bool:
        return is_believable(join, mine, theirs, self._gate, self._reach, 1)

    def _sky(self, one: _Map) -> Constellation:
        if one.sky is None:
            views = np.array([one.turn[i] * self._middle + one.shift[i] for i in one.turn])
            one.sky = Constellation.of(one.star_m, views)
        return one.sky

    def _merge(self, home: _Map, other: _Map, join: Join) -> None:
        """Move a map onto another; stars that coincide become one, weighted by their sightings."""
        where = join.turn * other.star_m + join.shift_m
        mine, theirs = pair_up(where, self._sky(home).tree, self._gate)
        name = np.full(len(where), -1, dtype=np.int64)
        name[mine] = theirs
        weight = other.seen[mine] / (home.seen[theirs] + other.seen[mine])
        home.star_m[theirs] += weight * (where[mine] - home.star_m[theirs])
        home.seen[theirs] += other.seen[mine]
        fresh = np.flatnonzero(name < 0)
        name[fresh] = len(home.star_m) + np.arange(len(fresh))
        home.star_m = np.concatenate((home.star_m, where[fresh]))
        home.seen = np.concatenate((home.seen, other.seen[fresh]))
        for picture in other.turn:
            home.turn[picture] = join.turn * other.turn[picture]
            home.shift[picture] = join.turn * other.shift[picture] + join.shift_m
            home.names[picture] = name[other.names[picture]]
        home.sky = None


def _result(one: _Map) -> LinkedMap:
    placed = np.array(sorted(one.turn), dtype=np.int64)
    shift = np.array([one.shift[i] for i in placed.tolist()])
    angle = np.angle(np.array([one.turn[i] for i in placed.tolist()]))
    names = [one.names[i] for i in placed.tolist()]
    return LinkedMap(
        pose=np.column_stack((as_plane(shift), angle)),
        placed=placed,
        star_m=one.star_m,
        frame=np.repeat(np.arange(len(placed)), [len(name) for name in names]),
        spot=np.concatenate([np.arange(len(name)) for name in names]),
        star=np.concatenate(names),
    )
