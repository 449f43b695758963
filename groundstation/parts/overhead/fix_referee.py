"""Fix referee: star fixes against overhead fixes of one vehicle, at one moment, with a verdict."""

from collections import deque
from collections.abc import Iterator

import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.frames import wrap_angle
from groundstation.fusion.state_memory import StateMemory
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.overhead.messages import FixComparison, OverheadFix
from groundstation.parts.stars.messages import StarFix
from groundstation.star_tracking.comparison import Referee

REACH_NS = 120_000_000
"""Exposures farther apart than this are not compared: the state's velocity carries one to the other."""
PATIENCE_NS = 3_000_000_000
"""A fix whose partner has not come by then stays alone."""


class FixReferee(Node):
    """Pairs each star fix with the overhead fix nearest in exposure, each fix once.

    The velocity of the state carries the overhead fix to the star fix's exposure; corrections of the
    state's pose in between do not matter.

    Args:
        vehicle: Its name.
        star_floor_sigma: What calibration leaves in every star fix: x, y (m), heading (rad).
        overhead_floor_sigma: Likewise in every overhead fix.
    """

    inputs = (StarFix, OverheadFix, VehicleState)
    outputs = (FixComparison,)

    def __init__(
        self, vehicle: str, star_floor_sigma: tuple[float, float], overhead_floor_sigma: tuple[float, float]
    ) -> None:
        super().__init__(vehicle)
        self._floor = np.zeros((3, 3))
        for xy_m, heading_rad in (star_floor_sigma, overhead_floor_sigma):
            self._floor += np.diag([xy_m**2, xy_m**2, heading_rad**2])
        self._memory: StateMemory[VehicleState] = StateMemory()
        self._stars: deque[StarFix] = deque()
        self._overhead: deque[OverheadFix] = deque()
        self._referee = Referee()

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case VehicleState():
                self._memory.remember(message)
                return
            case StarFix(fix=True):
                self._stars.append(message)
            case OverheadFix(fix=True):
                self._overhead.append(message)
            case _:
                return
        for waiting in (self._stars, self._overhead):
            while waiting and now_ns - waiting[0].stamp_ns > PATIENCE_NS:
                waiting.popleft()
        yield from self._pair()

    def _pair(self) -> Iterator[Message]:
        """Compare star fixes for which no nearer overhead fix can come any more."""
        while self._stars and self._overhead and self._overhead[-1].stamp_ns >= self._stars[0].stamp_ns:
            star = self._stars.popleft()
            nearest = min(self._overhead, key=lambda fix: abs(fix.stamp_ns - star.stamp_ns))
            if abs(nearest.stamp_ns - star.stamp_ns) > REACH_NS:
                continue
            compared = self._compare(star, nearest)
            if compared is not None:
                self._overhead.remove(nearest)
                yield compared

    def _compare(self, star: StarFix, overhead: OverheadFix) -> FixComparison | None:
        middle = self._memory.at((star.stamp_ns + overhead.stamp_ns) // 2)
        if middle is None:
            return None
        velocity = np.array([*middle.velocity_table_m_s, middle.rate_rad_s])
        apart_s = (overhead.stamp_ns - star.stamp_ns) * 1e-9
        difference = np.array([star.x_m - overhead.x_m, star.y_m - overhead.y_m, 0.0]) + velocity * apart_s
        turn = star.heading_rad - overhead.heading_rad + velocity[2] * apart_s
        difference[2] = wrap_angle(float(turn))
        stamp_variance_s2 = star.stamp_sigma_s**2 + overhead.stamp_sigma_s**2
        covariance = self._floor + stamp_variance_s2 * np.outer(velocity, velocity)
        for fix in (star, overhead):
            covariance = covariance + np.array(fix.covariance).reshape(3, 3)
        nis, verdict = self._referee.judge(difference, covariance)
        sigma = np.sqrt(np.diag(covariance)).tolist()
        return FixComparison(
            star.stamp_ns,
            self.vehicle,
            apart_s,
            (float(difference[0]), float(difference[1]), float(difference[2])),
            (sigma[0], sigma[1], sigma[2]),
            nis,
            verdict.pairs,
            verdict.mean_difference,
            verdict.mean_nis,
            verdict.word,
            verdict.reason,
        )
