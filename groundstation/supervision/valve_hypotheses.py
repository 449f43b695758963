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


_OPEN = Kind.OPEN  # found quickly, for each block
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
        cap: The most that a block adds.
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
    cap: float = BLOCK_CAP

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
        self._halves = [0.5 * size**2 for size in fit.sizes]
        self._of_valve = [
            (
                Suspicion(Kind.CLOSED, valve),
                Suspicion(Kind.WEAK, valve),
                Suspicion(Kind.OPEN, valve),
                Suspicion(Kind.LEAK, valve, cap=LEAK_CAP),
            )
            for valve in range(len(fit.gains))
        ]
        self.cases = [case for of_valve in self._of_valve for case in of_valve]

    def drop(self) -> None:
        """Forget every case."""
        for case in self.cases:
            case.drop()

    def weigh(self, block: Block, misfit: Misfit) -> bool:
        """Add a block to every case; whether it spoke for any of them."""
        x, y = misfit.force_m_s2
        by_turn = 0.5 * misfit.rate_rad_s**2 / misfit.rate_variance  # the most that the gyro can add
        signatures, halves, gains = self._fit.signatures, self._halves, self._fit.gains
        variance = misfit.force_variance
        spoke = False
        uncommanded = 2 if self._fit.knows_zero else 1
        for valve, share in enumerate(block.open_shares):
            turned = block.rate_shares[valve]
            sx, sy, _ = signatures[valve]
            along, half, gain = sx * x + sy * y, halves[valve], gains[valve]
            closed, weak, opened, leak = self._of_valve[valve]
            for case, whole in ((opened, gain), (leak, LEAK_SHARE))[:uncommanded]:
                amplitude = whole * (1.0 - share)
                by_force = (along - half * amplitude) * amplitude / variance
                if case.evidence > 0.0 or by_force + by_turn > 0.0:
                    spoke |= self._add(
                        case, block, misfit, (amplitude, whole * (1.0 - turned)), by_force, by_force
                    )
            if share > 0.0 or turned > 0.0 or closed.evidence > 0.0 or weak.evidence > 0.0:
                healthy = min(0.0, HEALTHY_GAIN - gain) * share
                usual = (along - half * healthy) * healthy / variance
                for case, left in ((closed, 0.0), (weak, WEAK_GAIN)):
                    amplitude = (left - gain) * share
                    by_force = (along - half * amplitude) * amplitude / variance
                    if case.evidence > 0.0 or by_force - usual + by_turn > 0.0:
                        spoke |= self._add(
                            case,
                            block,
                            misfit,
                            (amplitude, (left - gain) * turned),
                            by_force,
                            by_force - usual,
                        )
        return spoke

    def _add(
        self,
        case: Suspicion,
        block: Block,
        misfit: Misfit,
        amplitudes: tuple[float, float],
        by_force: float,
        over_healthy: float,
    ) -> bool:
        """Add a block to a case; whether it spoke for it.

        Args:
            case: Which.
            block: The block.
            misfit: Its residuals.
            amplitudes: Thrust too much by it, over full thrust: as accelerometers and gyro feel it.
            by_force: Log-likelihood ratio of the force to what is expected.
            over_healthy: Likewise to the worst valve that is still called healthy.
        """
        amplitude, turning = amplitudes
        cap, rate_variance = case.cap, misfit.rate_variance
        step = 0.5 * self._fit.signatures[case.valve][2] * block.span_s
        idle = case.rate_rad_s + case.amplitude * step
        moved = idle + turning * step
        by_rate = (misfit.rate_rad_s - 0.5 * moved) * moved / rate_variance
        whole = by_force + by_rate
        added = min(cap, min(BLOCK_CAP, over_healthy) + by_rate)
        weight = 1.0
        if case.kind is _OPEN:
            chance = OPENS_CHANCE + (STAYS_CHANCE - OPENS_CHANCE) * case.is_on
            still = (misfit.rate_rad_s - 0.5 * idle) * idle / rate_variance
            added, weight = _mixed(min(cap, still), added, chance)
            whole, _ = _mixed(still, whole, chance)
            by_rate = weight * by_rate + (1.0 - weight) * still
            moved = weight * moved + (1.0 - weight) * idle
        if case.evidence + added <= 0.0:
            if case.evidence > 0.0:
                case.drop()
            return False
        case.evidence += added
        case.unbounded += whole
        case.blocks += 1
        case.thrust_s += abs(weight * amplitude) * block.span_s
        if amplitude:
            case.residual_x += weight * misfit.force_m_s2[0]
            case.residual_y += weight * misfit.force_m_s2[1]
            case.variance += weight * misfit.force_variance
        case.by_rate += by_rate
        case.turning += 0.5 * moved * moved / rate_variance
        case.rate_rad_s = (1.0 - misfit.rate_gain) * moved
        case.amplitude = weight * turning
        case.is_on = weight
        return added > 0.0

    def direction(self, case: Suspicion) -> float:
        """Log-likelihood of where the thrust of the case points, whatever its size, and of its turning."""
        sx, sy, _ = self._fit.signatures[case.valve]
        size = self._fit.sizes[case.valve]
        along = (case.residual_x * sx + case.residual_y * sy) / size
        across = (case.residual_x * sy - case.residual_y * sx) / size
        variance = case.variance + (DIRECTION_SIGMA_RAD * along) ** 2
        return case.by_rate - 0.5 * across * across / variance

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
