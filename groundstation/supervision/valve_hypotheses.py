"""Sequential tests of what a valve may have: one cumulative log-likelihood ratio per valve and kind.

Each block adds the logarithm of the ratio of its likelihoods with and without the fault; the sum is never
less than 0, and an alarm is a sum above the threshold (CUSUM). Where thrust may come and go by itself, a
block is a mixture of both. No single block, and no single sensor, adds more than a stated amount: so one
shock proves nothing.
"""

import math
from dataclasses import dataclass
from enum import Enum

from groundstation.supervision.thrust_blocks import Block
from groundstation.supervision.thrust_fit import Misfit, ThrustFit

WEAK_GAIN = 0.5
HEALTHY_GAIN = 0.8
"""A valve that was better and is now this good is still called healthy."""
LEAK_SHARE = 0.15
OPENS_CHANCE, STAYS_CHANCE = 0.02, 0.95
"""Of a valve which opens by itself: that it does so in a block, and that it is still open in the next."""
DIRECTION_SIGMA_RAD = 0.06
"""Of what the accelerometers read of a valve: 5 mm of the centre of mass, or of the IMU's place."""
BLOCK_CAP = 8.0
LEAK_CAP = 1.0
"""A leak stands for small forces that last: half a second of them, not three blocks."""


class Kind(Enum):
    """What is wrong with a valve."""

    CLOSED = "valve_stuck_closed"
    WEAK = "valve_weak"
    OPEN = "valve_stuck_open"
    LEAK = "leak"


BY_ITSELF = frozenset((Kind.OPEN, Kind.LEAK))
"""Thrust that was not commanded."""


@dataclass(slots=True)
class Suspicion:
    """The case against one valve.

    Attributes:
        kind: What it would have.
        valve: Its number.
        evidence: The sum; 0 is none.
        unbounded: The same sum without caps, to compare cases with each other.
        thrust_s: Thrust that was missing or too much, as long at full thrust, since the case began.
        blocks: Number of blocks since then.
        residual_m_s2: Sum of the residuals that it would explain.
        variance: Of each component of that sum.
        by_rate: Part of the gyro in it, without caps.
        turning: What the gyro would have given for the case if it were true; minus that if nothing turned.
        rate_rad_s: By how much the expected rate would be off now.
        amplitude: Of the block before, as the gyro felt it.
        is_on: Chance that the valve was open in the block before, where it opens by itself.
    """

    kind: Kind
    valve: int
    evidence: float = 0.0
    unbounded: float = 0.0
    thrust_s: float = 0.0
    blocks: int = 0
    residual_x: float = 0.0
    residual_y: float = 0.0
    variance: float = 0.0
    by_rate: float = 0.0
    turning: float = 0.0
    rate_rad_s: float = 0.0
    amplitude: float = 0.0
    is_on: float = 0.0

    def drop(self) -> None:
        """Forget the case."""
        self.evidence = self.unbounded = self.thrust_s = 0.0
        self.residual_x = self.residual_y = self.variance = 0.0
        self.by_rate = self.turning = self.rate_rad_s = self.amplitude = self.is_on = 0.0
        self.blocks = 0


class ValveSuspicions:
    """All cases against the valves of a mock-up.

    Args:
        fit: Knows what each valve does.
    """

    def __init__(self, fit: ThrustFit) -> None:
        self._fit = fit
        self.cases = [Suspicion(kind, valve) for kind in Kind for valve in range(len(fit.gains))]
        self._least_size = 0.5 * min(fit.sizes)

    def drop(self) -> None:
        """Forget every case."""
        for case in self.cases:
            case.drop()

    def weigh(self, block: Block, misfit: Misfit) -> bool:
        """Add a block to every case; whether it spoke for any of them."""
        fit, span_s = self._fit, block.span_s
        x, y = misfit.force_m_s2
        is_calm = x * x + y * y < self._least_size**2
        spoke = False
        for case in self.cases:
            kind, valve = case.kind, case.valve
            healthy = 0.0
            chance = 1.0
            cap = BLOCK_CAP
            if kind is Kind.CLOSED or kind is Kind.WEAK:
                share, turned = block.open_shares[valve], block.rate_shares[valve]
                if share <= 0.0 and turned <= 0.0 and case.evidence <= 0.0:
                    continue
                gain = fit.gains[valve]
                factor = (0.0 if kind is Kind.CLOSED else WEAK_GAIN) - gain
                amplitude, turning = factor * share, factor * turned
                healthy = min(0.0, HEALTHY_GAIN - gain) * share
            else:
                if kind is Kind.OPEN:
                    if is_calm and case.evidence <= 0.0:
                        continue
                    chance = OPENS_CHANCE + (STAYS_CHANCE - OPENS_CHANCE) * case.is_on
                    gain = fit.gains[valve]
                    amplitude = gain * (1.0 - block.open_shares[valve])
                    turning = gain * (1.0 - block.rate_shares[valve])
                else:
                    cap = LEAK_CAP
                    amplitude = LEAK_SHARE * (1.0 - block.open_shares[valve])
                    turning = LEAK_SHARE * (1.0 - block.rate_shares[valve])
            sx, sy, st = fit.signatures[valve]
            along = sx * x + sy * y
            squared = 0.5 * fit.sizes[valve] ** 2
            by_force = (along - squared * amplitude) * amplitude / misfit.force_variance
            doubted = by_force - (along - squared * healthy) * healthy / misfit.force_variance
            idle = case.rate_rad_s + 0.5 * case.amplitude * st * span_s
            moved = idle + 0.5 * turning * st * span_s
            by_rate = (misfit.rate_rad_s * moved - 0.5 * moved * moved) / misfit.rate_variance
            whole = by_force + by_rate
            added = min(cap, min(BLOCK_CAP, doubted) + by_rate)
            weight = 1.0
            if chance < 1.0:
                still = (misfit.rate_rad_s * idle - 0.5 * idle * idle) / misfit.rate_variance
                added, weight = _mixed(min(cap, still), added, chance)
                whole, _ = _mixed(still, whole, chance)
                by_rate = weight * by_rate + (1.0 - weight) * still
            if case.evidence + added <= 0.0:
                if case.evidence > 0.0:
                    case.drop()
                continue
            spoke = spoke or added > 0.0
            case.evidence += added
            case.unbounded += whole
            case.blocks += 1
            case.thrust_s += abs(weight * amplitude) * span_s
            if amplitude:
                case.residual_x += weight * x
                case.residual_y += weight * y
                case.variance += weight * misfit.force_variance
            case.by_rate += by_rate
            case.turning += 0.5 * (weight * moved + (1.0 - weight) * idle) ** 2 / misfit.rate_variance
            left = 1.0 - misfit.rate_gain
            case.rate_rad_s = left * (weight * moved + (1.0 - weight) * idle)
            case.amplitude = weight * turning
            case.is_on = weight
        return spoke

    def direction(self, case: Suspicion) -> float:
        """Log-likelihood of the direction of what the case explains, whatever its size, and of the turning."""
        sx, sy, _ = self._fit.signatures[case.valve]
        size = self._fit.sizes[case.valve]
        along = (case.residual_x * sx + case.residual_y * sy) / size
        across = (case.residual_x * sy - case.residual_y * sx) / size
        return case.by_rate - 0.5 * across * across / (case.variance + (DIRECTION_SIGMA_RAD * along) ** 2)

    def is_along(self, case: Suspicion) -> bool:
        """Whether what the case explains points where its valve pushes."""
        sx, sy, _ = self._fit.signatures[case.valve]
        size = self._fit.sizes[case.valve]
        along = abs(case.residual_x * sx + case.residual_y * sy) / size
        across = abs(case.residual_x * sy - case.residual_y * sx) / size
        return across <= 0.35 * along + 3.0 * math.sqrt(case.variance)


def _mixed(off: float, on: float, chance: float) -> tuple[float, float]:
    """Log-likelihood ratio of a block that is on with that chance, and the chance after it.

    Args:
        off: Log-likelihood ratio if it is off.
        on: Likewise if it is on.
        chance: Before the block, between 0 and 1.
    """
    off, on = off + math.log(1.0 - chance), on + math.log(chance)
    high, low = max(off, on), min(off, on)
    total = high + math.log1p(math.exp(low - high))
    return total, math.exp(on - total)
