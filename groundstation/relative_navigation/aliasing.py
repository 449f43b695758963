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
FASTEST_RAD = 2.0 * math.pi * (MOST_TURNS + 2)
"""A search for a rate that comes here has run away."""
QUARTER_RAD = math.pi / 2.0
WINDOW = 4
"""Frames that are held against each other."""
UNEXPLAINED_RAD = 0.5
"""A frame this far from where a slow turn leads is no noise and no push: the turn was another one."""
_SIGMAS = 5.0
_LEAST_MISS_RAD = 0.02
_SHOTS = 7


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
        self._noted = 0
        self._verdict = False

    def forget(self) -> None:
        """Begin anew."""
        self._seen.clear()
        self._noted = 0
        self._verdict = False

    def note(self, t_s: float, inertial_from_body: Floats, sigma_rad: float) -> None:
        """Take the attitude of one frame, in any frame that does not turn."""
        self._seen.append(_Seen(t_s, inertial_from_body, sigma_rad))
        self._noted += 1
        if self._noted <= WINDOW or self._noted % WINDOW == 0:
            self._verdict = self._judged()

    @property
    def is_decided(self) -> bool:
        """Whether enough frames are there."""
        return len(self._seen) >= WINDOW

    def is_aliased(self) -> bool:
        """Whether the frames so far do not tell the rate, or tell of a rate beyond half a turn a frame."""
        return self._verdict

    def _judged(self) -> bool:
        if len(self._seen) < 2:
            return False
        seen = list(self._seen)
        shown = rotation_vector(seen[0].inertial_from_body.T @ seen[1].inertial_from_body)
        angle = float(np.linalg.norm(shown))
        if len(seen) == 2:
            return angle > QUARTER_RAD
        slowest = self._miss(seen, shown)
        if slowest <= 1.0 and angle <= QUARTER_RAD:
            return False
        faster = any(self._miss(seen, other) <= 1.0 for other in _further(shown, angle))
        if slowest <= 1.0:
            return faster
        if faster or angle > QUARTER_RAD:
            return True
        return self._off_rad(seen, shown) > UNEXPLAINED_RAD

    def _miss(self, seen: list[_Seen], shown: Floats) -> float:
        """How far a turn from the first frame to the second, carried on, misses the others: 1 is allowed."""
        rate = self._rate(seen, shown)
        if rate is None:
            return math.inf
        dt = seen[1].t_s - seen[0].t_s
        worst = 0.0
        for later in seen[2:]:
            span = later.t_s - seen[0].t_s
            carried = math.hypot(seen[0].sigma_rad, seen[1].sigma_rad) * span / dt
            allowed = _SIGMAS * math.hypot(carried, later.sigma_rad) + _LEAST_MISS_RAD
            worst = max(worst, self._gap(seen[0], later, rate) / allowed)
        return worst

    def _off_rad(self, seen: list[_Seen], shown: Floats) -> float:
        """How far the third frame is from where the turn that is seen leads."""
        rate = self._rate(seen, shown)
        return math.inf if rate is None else self._gap(seen[0], seen[2], rate)

    def _rate(self, seen: list[_Seen], shown: Floats) -> Floats | None:
        """The rate that turns the first frame's attitude into the second's; None if none is found."""
        dt = seen[1].t_s - seen[0].t_s
        goal = seen[0].inertial_from_body.T @ seen[1].inertial_from_body
        rate = shown / dt
        for _ in range(_SHOTS):
            if not float(np.linalg.norm(rate)) * abs(dt) < FASTEST_RAD:
                return None
            turned = turn_on(rate[None], self._inertia, dt)
            miss = rotation_vector(turned.turns[0].T @ goal)
            if float(np.linalg.norm(miss)) < 1e-5:
                return rate
            rate = rate + np.linalg.lstsq(turned.angle_by_rate[0], miss, rcond=1e-9)[0]
        return None

    def _gap(self, first: _Seen, later: _Seen, rate: Floats) -> float:
        turned = turn_on(rate[None], self._inertia, later.t_s - first.t_s).turns[0]
        off = rotation_vector((first.inertial_from_body @ turned).T @ later.inertial_from_body)
        return float(np.linalg.norm(off))


def _further(shown: Floats, angle: float) -> list[Floats]:
    axis = shown / angle if angle > 1e-9 else np.array((0.0, 0.0, 1.0))
    return [(angle + 2.0 * math.pi * more) * axis for more in range(-MOST_TURNS, MOST_TURNS + 1) if more != 0]
