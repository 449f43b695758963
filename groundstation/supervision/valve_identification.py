"""Thrust and dead time of each valve, learned while flying from commanded pulses and the IMU.

A Kalman filter over the blocks of `thrust_blocks`, linearised at what is known (L. Ljung, T. Soderstrom,
Theory and Practice of Recursive Identification, 1983). A mock-up that glides feels no slope, so in a block of
length S

    force = sum f_v share_v F_v / m + alpha x r - rate^2 r + zero        alpha = sum t_v share_v torque_v / I
    share_v = share commanded x sag + (ends x closes later - starts x opens later) / S

and the rate at the block's end is that at its beginning plus the integral of alpha. What can be seen is
thrust over mass, f, and torque over inertia, t, both over the rig's: a mass that is wrong looks like valves
that all are. A common shift of opening and closing looks like stamps that are late; the time between them
does not.
"""

import math

import numpy as np
from numpy.typing import NDArray

from groundstation.control.vehicle import VehicleModel
from groundstation.supervision.thrust_blocks import Block, ThrustBlocks
from groundstation.supervision.valve_estimate import LEARNED, IdentificationConfig, Learned, ValveEstimate

Floats = NDArray[np.float64]

_SET_ASIDE = 25.0
"""Squared sigmas of a block's three readings: beyond, by chance once in 50 000, something else pushed."""
_UNKNOWN_RATE_RAD_S = 10.0


class ValveIdentification:
    """Learns. Only to be fed while the vehicle floats and nothing is known to be broken.

    Args:
        model: Mass, inertia, valves.
        config: What is known beforehand.

    Attributes:
        set_aside: Blocks that were not learned from, since something that is no valve pushed in them.
    """

    def __init__(self, model: VehicleModel, config: IdentificationConfig) -> None:
        self._config = config
        self._count = n = len(model.valves)
        delays_s = (config.open_delay_s, config.close_delay_s)
        lags_s = (config.acc_lag_s, config.gyro_lag_s)
        self._blocks = ThrustBlocks(
            model, delays_s, config.rise_s, lags_s, config.block_s, config.sag, config.step_s
        )
        columns = model.effectiveness()
        self._push = columns[:2] / model.mass_kg
        self._turn = columns[2] / model.inertia_kg_m2
        self._thrust, self._torque = slice(0, n), slice(n, 2 * n)
        self._late_open, self._late_close = slice(2 * n, 3 * n), slice(3 * n, 4 * n)
        self._lever, self._zero = slice(4 * n, 4 * n + 2), slice(4 * n + 2, 4 * n + 4)
        self._sag, self._drift, self._rate = range(4 * n + 4, 4 * n + 7)
        self._value = np.zeros(4 * n + 7)
        self._value[: 2 * n] = 1.0
        self._value[self._lever] = config.imu_position_body_m
        self._value[self._sag] = config.sag
        self._covariance = np.diag(self._prior())
        delays = slice(2 * n, 4 * n)
        self._covariance[delays, delays] += config.shift_sigma_s**2
        self._before = self._spread()
        self._open_s = np.zeros(n)
        self.set_aside = 0
        self._is_rate_known = False

    def start(self) -> None:
        """Begin to be fed: the vehicle floats. What was learned of the valves stays."""
        self._blocks.reset()
        for index in (*range(self._zero.start, self._zero.stop), self._drift):
            self._restart(index, 0.0, self._prior()[index])
        self._is_rate_known = False

    def forget(self, valve: int) -> None:
        """Take it that a valve has changed: it is learned anew."""
        for index in range(valve, 4 * self._count, self._count):
            self._restart(index, float(index < 2 * self._count), self._prior()[index])
        self._open_s[valve] = 0.0

    def command(self, now_ns: int, pulse_id: int, on_time_ms: bytes | tuple[int, ...]) -> None:
        """Take every output of the guard at the moment it is sent; repeats of a pulse id change nothing."""
        self._blocks.command(now_ns, pulse_id, on_time_ms)

    def sample(
        self, stamp_ns: int, window_s: float, rate_rad_s: float, force_m_s2: tuple[float, float]
    ) -> bool:
        """Take an IMU sample; whether it completed a block that was learned from.

        Args:
            stamp_ns: End of its averaging window.
            window_s: Length of the window.
            rate_rad_s: Turn rate, zero removed.
            force_m_s2: Specific force x, y, body axes.
        """
        if not (math.isfinite(rate_rad_s) and all(map(math.isfinite, force_m_s2))):
            return False
        block = self._blocks.sample(stamp_ns, window_s, rate_rad_s, force_m_s2)
        return block is not None and self._learn(block)

    def estimates(self) -> tuple[ValveEstimate, ...]:
        """What is known of each valve by now."""
        spread, value, n = self._spread(), self._value, self._count
        rig_s = self._config.open_delay_s - self._config.close_delay_s
        dead_s = rig_s + value[self._late_open] - value[self._late_close]

        def learned(values: Floats, row: int, valve: int) -> Learned | None:
            sigma = float(spread[row, valve])
            is_learned = sigma < LEARNED * self._before[row, valve]
            return Learned(float(values[valve]), sigma) if is_learned else None

        return tuple(
            ValveEstimate(
                learned(value[self._thrust], 0, valve),
                learned(value[self._torque], 1, valve) if self._turn[valve] else None,
                learned(dead_s, 2, valve),
                float(self._open_s[valve]),
            )
            for valve in range(n)
        )

    def _prior(self) -> Floats:
        """Variances (4 n + 7,) before a flight, without the shift that delays have in common."""
        config, n = self._config, self._count
        sigma = np.empty(4 * n + 7)
        sigma[: 2 * n], sigma[2 * n : 4 * n] = config.thrust_sigma, config.delay_sigma_s
        sigma[self._lever], sigma[self._zero] = config.lever_sigma_m, config.zero_sigma_m_s2
        sigma[self._sag], sigma[self._drift] = config.sag_sigma, config.turn_sigma_rad_s2
        sigma[self._rate] = _UNKNOWN_RATE_RAD_S
        return np.square(sigma)

    def _spread(self) -> Floats:
        """Sigmas (3, n) of thrust, torque and dead time."""
        n = self._count
        variance = self._covariance.diagonal()
        late, early = np.arange(2 * n, 3 * n), np.arange(3 * n, 4 * n)
        dead = variance[late] + variance[early] - 2.0 * self._covariance[late, early]
        sigma = np.sqrt(np.vstack([variance[:n], variance[n : 2 * n], dead]))
        config = self._config
        floor = np.array([[config.model_sigma], [config.model_sigma], [config.model_sigma_s]])
        return np.asarray(np.hypot(sigma, floor))

    def _restart(self, index: int, value: float, variance: float) -> None:
        self._value[index] = value
        self._covariance[index, :] = self._covariance[:, index] = 0.0
        self._covariance[index, index] = variance

    def _learn(self, block: Block) -> bool:
        config, value, span_s = self._config, self._value, block.span_s
        if block.is_after_gap or not self._is_rate_known:
            self._restart(self._rate, block.rate_rad_s, _UNKNOWN_RATE_RAD_S**2)
            self._is_rate_known = True
        opened = _Opened(block, value[2 * self._count : 4 * self._count], value[self._sag] - config.sag)
        rows, expected = self._readings(block, opened)
        starts = opened.starts
        noise = np.diag(
            [config.acc_density_m_s2_rthz**2 / span_s] * 2 + [config.gyro_density_rad_s_rthz**2 / span_s]
        )
        # starts, not their squares: what straddles two blocks is late in both together
        jitter = np.sqrt(starts) * config.jitter_sigma_s
        moved = np.vstack([self._felt() / span_s, 0.5 * self._turn]) * jitter
        noise += moved @ moved.T
        left = np.array([*block.force_m_s2, block.rate_rad_s]) - expected
        across = self._covariance @ rows.T
        total = rows @ across + noise
        gain = np.linalg.solve(total, across.T).T
        is_learned = float(left @ np.linalg.solve(total, left)) < _SET_ASIDE
        if is_learned:
            self._value = value + gain @ left
            self._covariance -= gain @ total @ gain.T
            self._open_s += span_s * np.array(block.open_shares)
        else:
            self.set_aside += 1
        self._carry(span_s, opened, float((self._turn * jitter) @ (self._turn * jitter)))
        if not is_learned:
            self._is_rate_known = False
        return is_learned

    def _felt(self) -> Floats:
        """(2, n) what the accelerometers read of each valve at the rig's thrust, lever included."""
        x, y = self._value[self._lever]
        return np.asarray(self._push + np.vstack([-self._turn * y, self._turn * x]))

    def _readings(self, block: Block, opened: "_Opened") -> tuple[Floats, Floats]:
        """Rows (3, states) and expected readings (3,): force x, y, mean rate."""
        value, span_s, turn = self._value, block.span_s, self._turn
        thrust, torque = value[self._thrust], value[self._torque]
        x, y = value[self._lever]
        alpha = float(turn @ (torque * opened.share))
        squared = block.rate_rad_s**2
        arm = np.array([[-y], [x]])
        rows = np.zeros((3, len(value)))
        rows[:2, self._thrust] = self._push * opened.share
        rows[:2, self._torque] = arm * turn * opened.share
        given = self._push * thrust + arm * (turn * torque)
        rows[:2, self._late_open] = -given * opened.starts / span_s
        rows[:2, self._late_close] = given * opened.ends / span_s
        rows[:2, self._sag] = given @ opened.crowds
        rows[:2, self._lever] = [[-squared, -alpha], [alpha, -squared]]
        rows[[0, 1], [self._zero.start, self._zero.start + 1]] = 1.0
        rows[2] = self._turned(opened.turned_s, 0.5, opened.turned_crowds_s, 0.5 * span_s, opened)
        force = self._push @ (thrust * opened.share) + arm[:, 0] * alpha - squared * value[self._lever]
        rate = value[self._rate] + rows[2, self._torque] @ torque + 0.5 * span_s * value[self._drift]
        return rows, np.array([*(force + value[self._zero]), rate])

    def _turned(
        self, thrust_s: Floats, edge: float, crowds_s: Floats, span_s: float, opened: "_Opened"
    ) -> Floats:
        """How a rate depends on the states, given thrust since the block's start and the share of an edge."""
        torque = self._turn * self._value[self._torque]
        row = np.zeros(len(self._value))
        row[self._torque] = self._turn * (thrust_s + edge * opened.late_s)
        row[self._late_open] = -edge * torque * opened.starts
        row[self._late_close] = edge * torque * opened.ends
        row[self._sag] = torque @ crowds_s
        row[self._rate], row[self._drift] = 1.0, span_s
        return row

    def _carry(self, span_s: float, opened: "_Opened", jitter_variance: float) -> None:
        """The rate to the block's end, by what is known now; random walks."""
        config = self._config
        row = self._turned(opened.whole_s, 1.0, opened.whole_crowds_s, span_s, opened)
        torque = self._value[self._torque]
        self._value[self._rate] += row[self._torque] @ torque + span_s * self._value[self._drift]
        across = self._covariance @ row
        variance = float(row @ across) + jitter_variance
        self._covariance[self._rate, :] = self._covariance[:, self._rate] = across
        self._covariance[self._rate, self._rate] = variance
        walks = [config.zero_walk_m_s2_rts] * 2 + [config.turn_walk_rad_s2_rts]
        for index, walk in zip((self._zero.start, self._zero.start + 1, self._drift), walks, strict=True):
            self._covariance[index, index] += walk**2 * span_s


class _Opened:
    """A block's lists as arrays, with sag and delays as they are known."""

    def __init__(self, block: Block, late_s: Floats, more_sag: float) -> None:
        count = len(block.ends)
        plain, whole_s, turned_s = np.array([block.open_shares, block.rate_shares, block.turned_s])
        whole_s *= block.span_s
        self.crowds = np.array(block.crowds)
        sagged = np.array(block.sagged_shares) + more_sag * self.crowds
        # the gyro's lag is another one, the crowd is the same
        left, growth = np.divide(
            [sagged, self.crowds], plain, out=np.array([[1.0], [0.0]]) * np.ones(count), where=plain > 1e-6
        )
        self.ends, edges = left * block.ends, left * block.edges
        self.starts = np.maximum(0.0, edges - self.ends)
        self.late_s = late_s[count:] * self.ends - late_s[:count] * self.starts
        self.share = sagged + self.late_s / block.span_s
        self.whole_s, self.turned_s = left * whole_s, left * turned_s
        self.whole_crowds_s, self.turned_crowds_s = growth * whole_s, growth * turned_s
