"""The default estimator: an error-state filter that takes each late fix at its exposure.

The nominal state runs ahead packet by packet (`Reckoner`). State and covariance stay at the last used
exposure, the checkpoint, and move only when a fix is believed (`FixJudge`): checkpoint -> exposure over the
stored packets, correction there (`Course`), then the packets since are integrated again up to now.
"""

from __future__ import annotations

import math

from groundstation.fusion import error_state as es
from groundstation.fusion import measurements
from groundstation.fusion.agreement import MAX_SPEED_M_S
from groundstation.fusion.checkpoint import Checkpoint, Course
from groundstation.fusion.estimator import Array, Counters, Fix, FixOutcome, ImuPacket, Pair, PlanarState
from groundstation.fusion.fix_judge import FixJudge
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.reckoner import Reckoner
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.fusion.trace import Trace

LONGEST_HOLE_S = 2.0
"""Without packets for longer, forces and turns may have come and gone that no sigma holds: until a fix agrees
the filter is lost."""
PAUSE_S = 10.0
"""Of such a hole nothing is integrated: the pose is unknown until two fixes agree, as at the start."""
LOST_SPEED_M_S = MAX_SPEED_M_S
LOST_RATE_RAD_S = 0.2
"""What a vehicle may do while the filter is lost: its sigmas grow by that since the last used fix."""
HOLE_PERIODS = 10.0
"""A hole of more windows is carried through the covariance at once; of fewer, at the next fix."""
NEIGHBOURS = 25
"""Packets after a hole that tell, with those before it, what went on in it (``carry.c``)."""
LOOK_NS = 1_000_000_000
"""While no fix comes, how long the local slope is taken to be what it was."""


class ErrorStateFilter:
    """Heading, position, velocity, biases, slope, scale and lever arm from packets and late fixes.

    Args:
        noise: sensors and table of this mock-up.
        trace: where to write down every step for a smoother; all packets are then kept.
        table_map: what calibration knows of the table's slope; the filter estimates what is left of it.

    Raises:
        CoreError: there is no compiled core.
    """

    def __init__(
        self, noise: NoiseModel, trace: Trace | None = None, table_map: SlopeGrid | None = None
    ) -> None:
        self.noise = noise
        self.counters = Counters()
        self._map = table_map
        self._reckoner = Reckoner(noise, self.counters, table_map)
        self._course = Course(noise, table_map, self._reckoner.history, self.counters)
        self._judge = FixJudge(noise, self._course, self._reckoner, self.counters, trace)
        self._reported = self._judge.checkpoint
        """From which the report is reckoned."""
        self._look_due_ns = 0
        self._hole_end_s = -math.inf
        self._fixed_s = 0.0
        """Exposure of the last used fix."""
        self._is_reported_lost = False

    @property
    def x(self) -> Array:
        """(23 + 2m,) nominal state at the checkpoint, m nodes of the surface."""
        return self._judge.checkpoint.x

    @property
    def P(self) -> Array:  # noqa: N802 - as in the literature
        """(23 + 2m, 23 + 2m) covariance there."""
        return self._judge.checkpoint.P

    @property
    def stamp_off_s(self) -> float:
        """How far the newest packet's stamp lies from the tick that its readings hold at."""
        return self._reckoner.seconds(self._reckoner.newest_ns) - self._reckoner.newest_s

    @property
    def history(self) -> PacketHistory:
        """The stored packets; all of them when there is a trace."""
        return self._reckoner.history

    def begin_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle stands still."""
        self._reckoner.start_clock(t_ns)
        if self._course.rests.begin(self._reckoner.seconds(t_ns)):
            self._reckoner.rest(*self._course.rests.newest)

    def end_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle may move."""
        if self._course.rests.end(self._reckoner.seconds(t_ns)):
            self._reckoner.rest(*self._course.rests.newest)
            self._integrate_to_now()

    def doubt_forces(self, t_ns: int, *, x: bool, y: bool) -> None:
        """Say which accelerometers are not believed from this stamp on."""
        self._reckoner.start_clock(t_ns)
        self._course.doubt.change(self._reckoner.seconds(t_ns), x=x, y=y)
        self.counters.add("forces_doubted" if x or y else "forces_believed_again")

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Integrate one packet; None before the first fix, or when the packet was refused."""
        reckoner = self._reckoner
        if not reckoner.add(packet):
            return None
        if reckoner.crossed_s:
            self._cross(reckoner.crossed_s)
        if self._judge.waiting:
            self._judge.retry()
            self._follow()
        if packet.t_ns > self._look_due_ns:
            self._integrate_to_now()
        return reckoner.report() if reckoner.has_pose else None

    def add_fix(self, fix: Fix) -> FixOutcome:
        """Take a fix at its arrival and give account of it."""
        account = self._judge.add(fix)
        self._follow()
        return account

    def settled(self) -> list[FixOutcome]:
        """Hand over the accounts of fixes that had to wait for packets."""
        return self._judge.settled()

    def state(self) -> PlanarState | None:
        """Return the state after the newest packet."""
        return self._reckoner.report() if self._reckoner.has_pose else None

    def covariance(self) -> Array:
        """Return (6, 6) of x, y, heading, vx, vy, rate of the centre of mass now."""
        now = self._course.carry(self._judge.checkpoint, self._reckoner.newest_s)
        H = measurements.reported(now.x, self._reckoner.rate_rad_s)
        C: Array = H @ now.P[: es.SIZE, : es.SIZE] @ H.T
        if self._reckoner.is_lost:
            since_s = self._reckoner.newest_s - self._fixed_s
            for k, may in enumerate((LOST_SPEED_M_S, LOST_SPEED_M_S, LOST_RATE_RAD_S)):
                C[k, k] += (may * since_s) ** 2
                C[k + 3, k + 3] += may**2
        C[5, 5] += self.noise.gyro_density_rad_s_rthz**2 / self.noise.packet_period_s
        return C

    def expected_forces(self, rate_rad_s: float, push_m_s2: Pair, turn_rad_s2: float) -> Pair:
        """Return what the accelerometers would read under a known push of the centre of mass, body axes."""
        x = self.x
        bias_x, bias_y = float(x[es.ACC_BIAS_X]), float(x[es.ACC_BIAS_Y])
        state = self.state()
        if state is not None:  # it holds the temperature's part, and the slope's in body axes
            gx, gy = self.slope_left()
            if self._map is not None:
                known = self._map.at(state.x_m, state.y_m)
                gx, gy = gx + known[0], gy + known[1]
            c, s = math.cos(state.heading_rad), math.sin(state.heading_rad)
            bias_x, bias_y = state.bias_ax_m_s2 + c * gx + s * gy, state.bias_ay_m_s2 + c * gy - s * gx
        w = rate_rad_s - (x[es.GYRO_BIAS] if state is None else state.bias_rate_rad_s)
        rx, ry = float(x[es.LEVER_X]), float(x[es.LEVER_Y])
        return (
            bias_x + push_m_s2[0] - turn_rad_s2 * ry - w * w * rx,
            bias_y + push_m_s2[1] + turn_rad_s2 * rx - w * w * ry,
        )

    def slope_left(self) -> tuple[float, float]:
        """Return the table's pull beyond the map, x, y (m/s^2), as of the last used fix."""
        x = self.x
        return float(x[es.SLOPE_X] + x[es.WAVE_X]), float(x[es.SLOPE_Y] + x[es.WAVE_Y])

    def finish(self) -> None:
        """Write down the way from the last used fix to the newest packet, for the smoother."""
        self._judge.finish()

    def _cross(self, hole_s: float) -> None:
        """Report what a hole leaves open; be lost after a long one; at rest it leaves nothing open."""
        reckoner = self._reckoner
        reckoner.crossed_s = 0.0
        period_s = self.noise.packet_period_s
        if hole_s <= HOLE_PERIODS * period_s or not reckoner.has_pose:
            return
        if self._course.rests.at(reckoner.newest_s) is not None:
            return
        if hole_s <= LONGEST_HOLE_S:  # of a longer one no covariance says what may have gone on
            end_s = self._hole_end_s = reckoner.newest_s - period_s
            jump_rad_s = reckoner.history.jump_rad_s()
            self._course.doubt.missed(end_s - hole_s, end_s, jump_rad_s * hole_s / math.sqrt(12.0))
            self._integrate_to_now()
            # again as soon as the packets after it tell how busy the valves were
            self._look_due_ns = reckoner.newest_ns + round(NEIGHBOURS * period_s * 1e9)
            return
        reckoner.is_lost = True
        self._judge.unseen_until_s = reckoner.newest_s
        self.counters.add("packets_missing_for_long")
        if hole_s > PAUSE_S and self._judge.has_pose:
            before, until_s = self._judge.checkpoint, self._judge.unseen_until_s
            self._trust(before)
            standing = before.x[: es.MOVING].copy()
            standing[es.VX : es.VY + 1] = 0.0
            reckoner.load(before.x[: es.SIZE], standing)
            self._judge.begin_anew(until_s - hole_s, until_s)
            self._reported = self._judge.checkpoint
        else:
            self._integrate_to_now()

    def _follow(self) -> None:
        """Go on from another checkpoint, if fixes have made one; tell the sigmas when lost or found."""
        if (
            self._judge.checkpoint is not self._reported
            or self._reckoner.is_lost is not self._is_reported_lost
        ):
            self._integrate_to_now()

    def _integrate_to_now(self) -> None:
        """Run the nominal state from the checkpoint to now, and prepare the reported sigmas."""
        if not self._judge.has_pose:
            return
        reckoner, at = self._reckoner, self._judge.checkpoint
        self._reported = at
        if at.t_s < self._hole_end_s and not reckoner.is_lost:
            at = self._course.carry(at, reckoner.newest_s)  # no polynomial in time knows of the hole
        x = self._course.state_at(at, reckoner.newest_s, 1e-9 * LOOK_NS)
        self._look_due_ns = reckoner.newest_ns + LOOK_NS
        reckoner.load(x[: es.SIZE], x[: es.MOVING])
        self._trust(at)

    def _trust(self, at: Checkpoint) -> None:
        """Prepare the sigmas of the report from a checkpoint, wider while lost."""
        reckoner = self._reckoner
        variance = self._course.variance_in_time(at, reckoner.rate_rad_s)
        self._fixed_s, self._is_reported_lost = at.t_s, reckoner.is_lost
        if reckoner.is_lost:
            for squared, may in ((2, LOST_SPEED_M_S), (7, LOST_SPEED_M_S), (12, LOST_RATE_RAD_S)):
                variance[squared] += may**2
        reckoner.trust(at.t_s, variance)
