"""Whether a target turns so fast that frames show something else: a wheel that seems to run backwards.

Between two frames only the remainder of a turn is seen. Each whole number of further turns gives a rate;
Euler's equations carry it to the next frames, and the rates that meet them are possible. The slowest is
believed if it meets them; if only a faster one does, or a quarter of a turn a frame is passed and nothing
tells them apart, the target is aliased: its poses are good, its rates are not known.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.attitude_motion import turn_on
from groundstation.relative_navigation.rotations import rotation_vector

Floats = NDArray[np.float64]

MOST_TURNS = 2
"""Further whole turns that are thought of, either way."""
QUARTER_RAD = math.pi / 2.0
WINDOW = 4
"""Frames that are held against each other."""
_SIGMAS = 5.0
_LEAST_MISS_RAD = 0.02
_SHOTS = 12


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    t_s: float
    inertial_from_body: Floats
    sigma_rad: float


class AliasWatch:
    """Watches the attitudes of a target.

    Args:
        inertia_kg_m2: Its moments (3,); None: it is taken to keep its rate.
    """

    def __init__(self, inertia_kg_m2: Floats | None) -> None:
        self._inertia = inertia_kg_m2
        self._seen: deque[_Seen] = deque(maxlen=WINDOW)

    def forget(self) -> None:
        """Begin anew."""
        self._seen.clear()

    def note(self, t_s: float, inertial_from_body: Floats, sigma_rad: float) -> None:
        """Take the attitude of one frame, in any frame that does not turn."""
        self._seen.append(_Seen(t_s, inertial_from_body, sigma_rad))

    @property
    def is_decided(self) -> bool:
        """Whether enough frames are there."""
        return len(self._seen) >= WINDOW

    def is_aliased(self) -> bool:
        """Whether the frames so far do not tell the rate, or tell of a rate beyond half a turn a frame."""
        if len(self._seen) < 2:
            return False
        seen = list(self._seen)
        shown = rotation_vector(seen[0].inertial_from_body.T @ seen[1].inertial_from_body)
        angle = float(np.linalg.norm(shown))
        if len(seen) == 2:
            return angle > QUARTER_RAD
        if self._meets(seen, shown):
            if angle <= QUARTER_RAD:
                return False
            return any(self._meets(seen, other) for other in _further(shown, angle))
        return angle > QUARTER_RAD or any(self._meets(seen, other) for other in _further(shown, angle))

    def _meets(self, seen: list[_Seen], shown: Floats) -> bool:
        """Whether a turn from the first frame to the second, carried on, leads to the others."""
        first, second = seen[0], seen[1]
        dt = second.t_s - first.t_s
        rate = shown / dt
        goal = first.inertial_from_body.T @ second.inertial_from_body
        for _ in range(_SHOTS):
            miss = rotation_vector(turn_on(rate[None], self._inertia, dt).turns[0].T @ goal)
            if float(np.linalg.norm(miss)) < 1e-4:
                break
            rate = rate + miss / dt
        else:
            return False
        for later in seen[2:]:
            span = later.t_s - first.t_s
            off = rotation_vector(
                (first.inertial_from_body @ turn_on(rate[None], self._inertia, span).turns[0]).T
                @ later.inertial_from_body
            )
            carried = math.hypot(first.sigma_rad, second.sigma_rad) * span / dt
            allowed = _SIGMAS * math.hypot(carried, later.sigma_rad) + _LEAST_MISS_RAD
            if float(np.linalg.norm(off)) > allowed:
                return False
        return True


def _further(shown: Floats, angle: float) -> list[Floats]:
    axis = shown / angle if angle > 1e-9 else np.array((0.0, 0.0, 1.0))
    return [(angle + 2.0 * math.pi * more) * axis for more in range(-MOST_TURNS, MOST_TURNS + 1) if more != 0]
