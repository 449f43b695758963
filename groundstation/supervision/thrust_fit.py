"""What a healthy mock-up should feel in a block, learned within bounds, and how far off that may be.

Learned are a gain of each valve (its thrust over the rig's, mass error included), the accelerometers' zero
and the closing delay that all valves share. The bounds are those of healthy parts, so that a fault cannot be
learned away.
"""

import math
from dataclasses import dataclass

from groundstation.control.vehicle import VehicleModel
from groundstation.supervision.thrust_blocks import Block

_SHUT = 0.02  # a sum of shares below this is no thrust worth learning from
_WELL_OPEN = 0.3
_ZERO_KNOWN_M_S2 = 1e-3
WEAK_GAIN_SIGMA = 0.1
"""Of what a valve that was named weak gives."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FitConfig:
    """What the rig leaves open; one sigma unless said otherwise.

    Attributes:
        imu_position_body_m: Accelerometers from the centre of mass.
        gyro_density_rad_s_rthz: White noise of the rate.
        acc_density_m_s2_rthz: White noise of the specific force.
        sag: Factor of thrust per further open valve.
        gain_sigma: Of a valve's thrust over mass before anything is learned.
        gain_bound: Farthest a healthy valve is from the rig's thrust.
        pulse_gain_sigma: From block to block: sag, direction, lever.
        edge_sigma_s: Of the moment of a start or an end of thrust, jitter of stamps included.
        delay_sigma_s: Of the closing delay that all valves share.
        delay_bound_s: Largest such delay.
        zero_sigma_m_s2: Of the accelerometers' zero at the start: at rest it holds the table's slope.
        zero_bound_m_s2: Farthest it may be from the zero given at the start.
        zero_walk_m_s2_rts: Its random walk.
        force_floor_m_s2: Forces per mass that nothing here explains: drag, hoses.
        turn_floor_rad_s2: Turning that nothing here explains.
    """

    imu_position_body_m: tuple[float, float]
    gyro_density_rad_s_rthz: float
    acc_density_m_s2_rthz: float
    sag: float = 0.97
    gain_sigma: float = 0.15
    gain_bound: float = 0.3
    pulse_gain_sigma: float = 0.06
    edge_sigma_s: float = 0.0015
    delay_sigma_s: float = 0.0015
    delay_bound_s: float = 0.004
    zero_sigma_m_s2: float = 0.004
    zero_bound_m_s2: float = 0.008
    zero_walk_m_s2_rts: float = 1e-4
    force_floor_m_s2: float = 5e-4
    turn_floor_rad_s2: float = 0.005


@dataclass(slots=True)
class Misfit:
    """A block less what was expected.

    Attributes:
        force_m_s2: Residual x, y.
        force_variance: Of each of them.
        rate_rad_s: Residual of the rate against the way it was expected to change.
        rate_variance: Of it.
        rate_gain: Share of the rate's residual that is believed before the next block.
        commanded_m_s2: Sum of what the commanded valves push, each by itself.
    """

    force_m_s2: tuple[float, float]
    force_variance: float
    rate_rad_s: float
    rate_variance: float
    rate_gain: float
    commanded_m_s2: float


class ThrustFit:
    """Predicts, compares, learns.

    Args:
        model: Mass, inertia, valves.
        config: What is not known of them.

    Attributes:
        signatures: Of each valve at full thrust by the rig: what the accelerometers read (x, y), turning.
        sizes: Lengths of the first two.
        gains: Of each valve, learned.
    """

    def __init__(self, model: VehicleModel, config: FitConfig) -> None:
        self._config = config
        self._arm = config.imu_position_body_m
        self.signatures: list[tuple[float, float, float]] = []
        for fx, fy, torque in model.effectiveness().T.tolist():
            turn = torque / model.inertia_kg_m2
            self.signatures.append(
                (
                    fx / model.mass_kg - turn * self._arm[1],
                    fy / model.mass_kg + turn * self._arm[0],
                    turn,
                )
            )
        self.sizes = [math.hypot(x, y) for x, y, _ in self.signatures]
        count = len(self.signatures)
        self.gains = [1.0] * count
        self._gain_variances = [config.gain_sigma**2] * count
        self._weak: dict[int, float] = {}  # gain of a valve that is known to be weak
        self._gain_floor = (0.05 * config.gain_sigma) ** 2
        self._delay_s, self._delay_variance = 0.0, config.delay_sigma_s**2
        self.start((0.0, 0.0))

    def start(self, zero_m_s2: tuple[float, float]) -> None:
        """Begin a flight; what was learned of the valves stays.

        Args:
            zero_m_s2: Zero of the accelerometers as known now.
        """
        self._given_zero = zero_m_s2
        self._zero = zero_m_s2
        self._zero_variance = self._config.zero_sigma_m_s2**2
        self.lose_rate()

    def shift_zero(self, step_m_s2: tuple[float, float]) -> None:
        """Take it that the accelerometers' zero jumped by that."""
        self._given_zero = (self._given_zero[0] + step_m_s2[0], self._given_zero[1] + step_m_s2[1])
        self._zero = (self._zero[0] + step_m_s2[0], self._zero[1] + step_m_s2[1])
        self._zero_variance = self._config.zero_sigma_m_s2**2

    def take_weak(self, valve: int, missing: float) -> None:
        """Take it that a valve gives less from now on.

        Args:
            valve: Its number.
            missing: Share of what it gave before.
        """
        self.gains[valve] = self._weak[valve] = self.gains[valve] * (1.0 - missing)
        self._gain_variances[valve] = WEAK_GAIN_SIGMA**2

    @property
    def weak(self) -> frozenset[int]:
        """Valves that are known to be weak or closed."""
        return frozenset(self._weak)

    def take_healthy(self, valve: int) -> None:
        """Take it that a valve which was weak may be healthy."""
        del self._weak[valve]
        self.gains[valve] = 1.0
        self._gain_variances[valve] = self._config.gain_sigma**2

    def forget_weak(self) -> None:
        """Take it that all valves may be healthy."""
        for valve in self.weak:
            self.take_healthy(valve)

    def doubt_zero(self) -> None:
        """Take it that the zero, as learned so far, may be wrong: it is learned anew from here."""
        self._zero_variance = self._config.zero_sigma_m_s2**2

    @property
    def knows_zero(self) -> bool:
        """Whether a small force that lasts is no longer the accelerometers' unknown zero."""
        return self._zero_variance < _ZERO_KNOWN_M_S2**2

    def lose_rate(self) -> None:
        """Take the next block's rate as it is: something turned the vehicle that was no valve."""
        self._rate_variance = float("inf")
        self._rate = 0.0
        self._share_before = [0.0] * len(self.gains)

    def compare(self, block: Block) -> Misfit:
        """The block's residuals; the rate's state moves on."""
        config, span_s = self._config, block.span_s
        x, y = block.force_m_s2
        rate = block.rate_rad_s
        x += rate * rate * self._arm[0] - self._zero[0]
        y += rate * rate * self._arm[1] - self._zero[1]
        variance = config.acc_density_m_s2_rthz**2 / span_s + config.force_floor_m_s2**2 + self._zero_variance
        open_valves = sum(block.open_shares)
        sag = config.sag ** (open_valves - 1.0) if open_valves > 1.0 else 1.0
        commanded = turn = turn_variance = 0.0
        edge = (config.edge_sigma_s / span_s) ** 2 + self._delay_variance / span_s**2
        before, now = self._share_before, block.rate_shares
        for valve, share in enumerate(block.open_shares):
            spread = 0.5 * (before[valve] + now[valve])
            edges = block.edges[valve]
            if share <= 0.0 and spread <= 0.0 and edges <= 0.0:
                continue
            size, gain = self.sizes[valve], self.gains[valve]
            sx, sy, st = self.signatures[valve]
            late = self._delay_s * block.ends[valve] / span_s
            push = gain * sag * (share + late)
            x -= push * sx
            y -= push * sy
            turn += gain * sag * (spread + late) * st
            commanded += size * share
            doubt = self._gain_variances[valve] + config.pulse_gain_sigma**2
            variance += size * size * (doubt * share * share + edge * edges)
            # the lever of a valve is known no better than its thrust
            turn_variance += st * st * ((2.0 * doubt) * spread * spread + edge * edges)
        return self._rated(block, (x, y), variance, turn, turn_variance, commanded)

    def _rated(
        self,
        block: Block,
        force: tuple[float, float],
        variance: float,
        turn: float,
        turn_variance: float,
        commanded: float,
    ) -> Misfit:
        """Carry the rate on and compare it."""
        config, span_s = self._config, block.span_s
        noise = config.gyro_density_rad_s_rthz**2 / span_s
        self._share_before = block.rate_shares
        if self._rate_variance == float("inf") or block.is_after_gap:
            self._rate, self._rate_variance = block.rate_rad_s, noise
            return Misfit(force, variance, 0.0, noise, 1.0, commanded)
        expected = self._rate + turn * span_s
        prior = self._rate_variance + (turn_variance + config.turn_floor_rad_s2**2) * span_s**2
        total = prior + noise
        gain = prior / total
        residual = block.rate_rad_s - expected
        self._rate = expected + gain * residual
        self._rate_variance = (1.0 - gain) * prior
        return Misfit(force, variance, residual, total, gain, commanded)

    def learn(self, block: Block, misfit: Misfit) -> None:
        """Take a block that nothing speaks against."""
        config, span_s, total = self._config, block.span_s, misfit.force_variance
        x, y = misfit.force_m_s2
        self._zero_variance += config.zero_walk_m_s2_rts**2 * span_s
        share = self._zero_variance / total
        self._zero = (
            _within(self._zero[0] + share * x, self._given_zero[0], config.zero_bound_m_s2),
            _within(self._zero[1] + share * y, self._given_zero[1], config.zero_bound_m_s2),
        )
        self._zero_variance *= 1.0 - share
        if sum(block.open_shares) < _SHUT:
            return
        end_x = end_y = 0.0
        for valve, share in enumerate(block.open_shares):
            sx, sy, _ = self.signatures[valve]
            ends = block.ends[valve] / span_s
            end_x, end_y = end_x + ends * sx, end_y + ends * sy
            if share < _WELL_OPEN:
                continue
            doubt = self._gain_variances[valve]
            pull = doubt * share / total
            middle = self._weak.get(valve, 1.0)
            bound = WEAK_GAIN_SIGMA if valve in self._weak else config.gain_bound
            self.gains[valve] = _within(self.gains[valve] + pull * (sx * x + sy * y), middle, bound)
            left = 1.0 - pull * share * self.sizes[valve] ** 2
            self._gain_variances[valve] = max(self._gain_floor, left * doubt)
        squared = end_x * end_x + end_y * end_y
        if squared > 0.0:
            pull = self._delay_variance / total
            self._delay_s = _within(self._delay_s + pull * (end_x * x + end_y * y), 0.0, config.delay_bound_s)
            self._delay_variance = max(
                (0.1 * config.delay_sigma_s) ** 2, self._delay_variance * (1.0 - pull * squared)
            )


def _within(value: float, middle: float, bound: float) -> float:
    return min(max(value, middle - bound), middle + bound)
