"""Sequential tests of what a valve may have: one cumulative log-likelihood ratio per valve and kind.

Each block adds the logarithm of the ratio of its likelihoods with and without the fault; the sum is never
less than 0, and an alarm is a sum above the threshold (CUSUM). Where thrust may come and go by itself, a
block is a mixture of both. No single block, and no single sensor, adds more than a stated amount: so one
shock proves nothing.
"""

from dataclasses import dataclass
from enum import Enum

from groundstation.supervision.thrust_blocks import Block
from groundstation.supervision.thrust_fit import Misfit, ThrustFit
from groundstation.supervision.valve_trial import OPENS_CHANCE, STAYS_CHANCE, mixed

WEAK_GAIN = 0.5
HEALTHY_GAIN = 0.8
"""A valve that was better and is now this good is still called healthy."""
KNOWN_WEAK_GAIN, KNOWN_CLOSED_GAIN = 0.6, 0.25
"""Below the gain of any healthy valve: this one was named weak, or closed, before."""
LEAK_SHARE = 0.15
BLOCK_CAP = 8.0
LEAK_CAP = 1.0
"""A leak stands for small forces that last: half a second of them, not three blocks."""


class Symptom(Enum):
    """What a case against a valve looks for."""

    CLOSED = "no thrust when commanded"
    WEAK = "half its thrust"
    OPEN = "thrust when not commanded"
    LEAK = "some thrust when not commanded"


_OPEN = Symptom.OPEN  # found quickly, for each block


@dataclass(slots=True)
class Suspicion:
    """The case against one valve.

    Attributes:
        symptom: What it looks for.
        valve: Its number.
        evidence: The sum; 0 is none.
        blocks: Number of blocks since the case began.
        rate_rad_s: By how much the expected rate would be off now.
        amplitude: Of the block before, as the gyro felt it.
        is_on: Chance that the valve was open in the block before, where it opens by itself.
        cap: The most that a block adds.
    """

    symptom: Symptom
    valve: int
    evidence: float = 0.0
    blocks: int = 0
    rate_rad_s: float = 0.0
    amplitude: float = 0.0
    is_on: float = 0.0
    cap: float = BLOCK_CAP

    def drop(self) -> None:
        """Forget the case."""
        self.evidence = self.rate_rad_s = self.amplitude = self.is_on = 0.0
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
                Suspicion(Symptom.CLOSED, valve),
                Suspicion(Symptom.WEAK, valve),
                Suspicion(Symptom.OPEN, valve),
                Suspicion(Symptom.LEAK, valve, cap=LEAK_CAP),
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
                    spoke |= self._add(case, block, misfit, whole * (1.0 - turned), by_force)
            if share > 0.0 or turned > 0.0 or closed.evidence > 0.0 or weak.evidence > 0.0:
                healthy = min(0.0, HEALTHY_GAIN - gain) * share
                usual = (along - half * healthy) * healthy / variance
                known = (gain <= KNOWN_CLOSED_GAIN) + (gain <= KNOWN_WEAK_GAIN)
                for case, left in ((closed, 0.0), (weak, WEAK_GAIN))[: 2 - known]:
                    amplitude = (left - gain) * share
                    by_force = (along - half * amplitude) * amplitude / variance - usual
                    if case.evidence > 0.0 or by_force + by_turn > 0.0:
                        spoke |= self._add(case, block, misfit, (left - gain) * turned, by_force)
        return spoke

    def _add(self, case: Suspicion, block: Block, misfit: Misfit, turning: float, by_force: float) -> bool:
        """Add a block to a case; whether it spoke for it.

        Args:
            case: Which.
            block: The block.
            misfit: Its residuals.
            turning: Thrust too much by it, over full thrust, as the gyro feels it.
            by_force: Log-likelihood ratio of the force to that of the worst valve still called healthy.
        """
        cap, rate_variance = case.cap, misfit.rate_variance
        step = 0.5 * self._fit.signatures[case.valve][2] * block.span_s
        idle = case.rate_rad_s + case.amplitude * step
        moved = idle + turning * step
        by_rate = (misfit.rate_rad_s - 0.5 * moved) * moved / rate_variance
        added = min(cap, min(BLOCK_CAP, by_force) + by_rate)
        if case.symptom is _OPEN:
            chance = OPENS_CHANCE + (STAYS_CHANCE - OPENS_CHANCE) * case.is_on
            still = (misfit.rate_rad_s - 0.5 * idle) * idle / rate_variance
            added, weight = mixed(min(cap, still), added, chance)
            moved = weight * moved + (1.0 - weight) * idle
            turning, case.is_on = weight * turning, weight
        if case.evidence + added <= 0.0:
            if case.evidence > 0.0:
                case.drop()
            case.is_on = 0.0
            return False
        case.evidence += added
        case.blocks += 1
        case.rate_rad_s = (1.0 - misfit.rate_gain) * moved
        case.amplitude = turning
        return added > 0.0
