"""What the filter did, step by step, so that a smoother can walk it backwards.

N is the length of the state at that step: 23, and two for each node of the learned surface.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """The local slope was taken anew from the surface's nodes, after one was given up and one was added."""

    weights: Array
    """(2, N - 23) of the nodes' slopes, the added one among them."""
    grown: Array | None
    """(2, N - 25): the added node's slope from the others', if one was added."""
    dropped: int | None
    """The node that was given up before, if one was."""


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """The state was carried to `stop_s`: five moving rows changed, the others stayed."""

    stop_s: float
    rows: Array
    """(5, 23) of the transition."""
    x: Array
    """(23,) after the step."""
    P: Array
    """(23, N) of the covariance after the step."""
    is_rest: bool


@dataclass(frozen=True, slots=True, eq=False)
class Corrected:
    """The state was corrected by a measurement."""

    H: Array
    """(m, 23)."""
    K: Array
    """(N, m) gain."""
    weight: Array
    """(m, m) inverse of the innovation's covariance."""
    z: Array
    """(m,) innovation."""


Step = Looked | Carried | Corrected


@dataclass(slots=True, eq=False)
class Chain:
    """Steps since the filter took a pose, until it lost itself or the data ended."""

    start_s: float
    x: Array
    """(23,)."""
    P: Array
    """(23, N)."""
    is_rest: bool
    steps: list[Step] = field(default_factory=list)


class Trace:
    """The chains of one run, in order."""

    __slots__ = ("chains",)

    def __init__(self) -> None:
        self.chains: list[Chain] = []
