"""What the filter did, step by step, so that a smoother can walk it backwards."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """The state was carried to `stop_s` by x = F x + noise."""

    stop_s: float
    F: Array
    """(23, 23)."""
    x: Array
    """(23,) after the step."""
    P: Array
    """(23, 23) after the step."""
    is_rest: bool


@dataclass(frozen=True, slots=True, eq=False)
class Corrected:
    """The state was corrected by a measurement."""

    H: Array
    """(m, 23)."""
    K: Array
    """(23, m) gain."""
    weight: Array
    """(m, m) inverse of the innovation's covariance."""
    z: Array
    """(m,) innovation."""


@dataclass(slots=True, eq=False)
class Chain:
    """Steps since the filter took a pose, until it lost itself or the data ended."""

    start_s: float
    x: Array
    P: Array
    is_rest: bool
    steps: list[Carried | Corrected] = field(default_factory=list)


class Trace:
    """The chains of one run, in order."""

    __slots__ = ("chains",)

    def __init__(self) -> None:
        self.chains: list[Chain] = []
