"""Which valve it is, once something is wrong: every explanation is weighed over the same blocks.

A generalized likelihood ratio test (Willsky and Jones 1976): of each explanation the logarithm of its
likelihood over that of a healthy mock-up, at the best size and the best of a few moments when it may have
begun. Opposite valves explain the same motion for a while; what tells them apart are the blocks in which
only one of them was commanded, before the alarm and after it.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.supervision.thrust_blocks import Block
from groundstation.supervision.thrust_fit import Misfit, ThrustFit

OPENS_CHANCE, STAYS_CHANCE = 0.02, 0.95
"""Of a valve which opens now and then: that it does so in a block, and that it is still open in the next."""
CLOSED_SHARE = 0.75
"""Missing so much of its thrust, a valve is closed; else it is weak."""
_MISSING, _ADDED, _AGAIN = (0.4, 1.0), (0.1, 1.2), (0.3, 1.2)
_ZERO_M_S2 = (-0.010, 0.010)
_SUPPLY, _LATE_S = (0.4, 1.0), (-0.008, 0.008)


class Kind(Enum):
    """What is wrong with a valve, or with all of them."""

    CLOSED = "valve_stuck_closed"
    WEAK = "valve_weak"
    OPEN = "valve_stuck_open"
    WORKS = "works again"
    SUPPLY = "supply pressure"
    ZERO = "another zero of the accelerometers"
    TIMING = "delays other than the rig's"


class Explanation(NamedTuple):
    """What a trial has found of one explanation.

    Attributes:
        kind: What it would be.
        valve: Number of the valve; -1 for all of them.
        likelihood: Logarithm of its likelihood over that of a healthy mock-up.
        is_twice: Whether two stretches of time speak for it, each with half a threshold at least.
        size: Of full thrust; seconds of a delay.
        thrust_s: Thrust that was missing or too much, as long at full thrust.
        turning: What the gyro would have given for it if it were true.
        by_rate: What the gyro gave.
        across: Size of what is left across its direction over what is along it.
        across_sigma: One sigma of that.
        is_steady: It lasts; a valve that opens now and then gives its thrust for a while only.
    """

    kind: Kind
    valve: int
    likelihood: float
    is_twice: bool
    size: float
    thrust_s: float
    turning: float
    by_rate: float
    across: float
    across_sigma: float
    is_steady: bool = True


@dataclass(slots=True)
class _Opening:
    """A valve that opens now and then at full thrust: a chain of two states."""

    likelihood: float = 0.0
    is_on: float = 0.0
    rate_rad_s: float = 0.0
    before: float = 0.0
    thrust_s: float = 0.0


class ValveTrial:
    """Weighs explanations.

    Args:
        fit: Knows what each valve does.
        blocks: Numbers of blocks, blocks, what was left of them, in order: those so far.
        onsets: Numbers of blocks at which a fault may have begun.
        marks: Numbers of the blocks that raised an alarm.
        witness: What each of two stretches of time has to give, in natural logarithms.
    """

    def __init__(
        self,
        fit: ThrustFit,
        blocks: Iterable[tuple[int, Block, Misfit]],
        onsets: Sequence[int],
        marks: Sequence[int],
        witness: float,
    ) -> None:
        self._gains = np.array(fit.gains)
        self._signatures = np.array(fit.signatures)
        self._halves = [0.5 * size**2 for size in fit.sizes]
        self._count = count = len(fit.gains)
        self._witness = witness
        self._onsets = sorted(set(onsets))
        self._marks = frozenset(marks)
        # columns: of each valve thrust that is missing, not commanded, more than is known of it; then of all
        # valves missing thrust, late opening, late closing; of the accelerometers another zero in x, in y
        again = [_AGAIN if valve in fit.weak else (0.0, 0.0) for valve in range(count)]
        self._low, self._high = np.array(
            [_MISSING] * count
            + [_ADDED] * count
            + again
            + [_SUPPLY, _LATE_S, _LATE_S, _ZERO_M_S2, _ZERO_M_S2]
        ).T
        shape = (len(self._onsets), len(self._low))
        self._force, self._squared, self._cross = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self._turn, self._turn_squared = np.zeros(shape), np.zeros(shape)
        self._rate, self._thrust_s = np.zeros(shape), np.zeros(shape)
        self._before = np.zeros(shape)
        self._at_marks: list[NDArray[np.float64]] = []
        self._openings = [_Opening() for _ in range(count)]
        self._openings_at_marks: list[list[float]] = []
        for number, block, misfit in blocks:
            self.add(number, block, misfit)

    def add(self, number: int, block: Block, misfit: Misfit) -> None:
        """Take a block."""
        active = sum(onset <= number for onset in self._onsets)
        x, y = misfit.force_m_s2
        span_s, rate = block.span_s, misfit.rate_rad_s
        felt, turned = self._columns(block)
        inverse, rate_inverse = 1.0 / misfit.force_variance, 1.0 / misfit.rate_variance
        now = slice(0, active)
        self._force[now] += inverse * (felt[0] * x + felt[1] * y)
        self._cross[now] += inverse * (felt[0] * y - felt[1] * x)
        self._squared[now] += inverse * (felt[0] * felt[0] + felt[1] * felt[1])
        moved = self._rate[now] + 0.5 * span_s * (self._before[now] + turned)
        self._turn[now] += rate_inverse * rate * moved
        self._turn_squared[now] += rate_inverse * moved * moved
        self._rate[now] = (1.0 - misfit.rate_gain) * moved
        self._before[now] = turned
        self._thrust_s[now] += span_s * felt[2]
        self._open(block, misfit)
        if number in self._marks:
            self._at_marks.append(self._likelihoods(self._sizes()))
            self._openings_at_marks.append([opening.likelihood for opening in self._openings])

    def _columns(self, block: Block) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Force x, y and share, and turning, of each explanation at size 1."""
        sx, sy, st = self._signatures.T
        shares, turns = np.array(block.open_shares), np.array(block.rate_shares)
        ends = np.array(block.ends) / block.span_s
        starts = np.array(block.edges) / block.span_s - ends
        gains = self._gains
        given, turning = gains * shares, gains * turns
        late, long = gains * starts, gains * ends
        felt = np.empty((3, len(self._low)))
        count = self._count
        for row, by_valve in enumerate((sx, sy, np.ones(count))):
            felt[row, :count] = -given * by_valve
            felt[row, count : 2 * count] = (1.0 - shares) * by_valve
            felt[row, 2 * count : 3 * count] = shares * by_valve
            felt[row, 3 * count :] = -given @ by_valve, -late @ by_valve, long @ by_valve, 0.0, 0.0
        felt[2] = abs(felt[2])
        felt[0, -2] = felt[1, -1] = 1.0
        turned = np.empty(len(self._low))
        turned[:count] = -turning * st
        turned[count : 2 * count] = (1.0 - turns) * st
        turned[2 * count : 3 * count] = turns * st
        turned[3 * count :] = -turning @ st, -late @ st, long @ st, 0.0, 0.0
        return felt, turned

    def _open(self, block: Block, misfit: Misfit) -> None:
        """Valves that open now and then: a block is a mixture of open and not."""
        x, y = misfit.force_m_s2
        for valve, opening in enumerate(self._openings):
            sx, sy, st = self._signatures[valve].tolist()
            gain = float(self._gains[valve])
            more = gain * (1.0 - block.open_shares[valve])
            turned = gain * (1.0 - block.rate_shares[valve])
            step = 0.5 * st * block.span_s
            idle = opening.rate_rad_s + opening.before * step
            moved = idle + turned * step
            by_force = (sx * x + sy * y - self._halves[valve] * more) * more / misfit.force_variance
            still = (misfit.rate_rad_s - 0.5 * idle) * idle / misfit.rate_variance
            by_rate = (misfit.rate_rad_s - 0.5 * moved) * moved / misfit.rate_variance
            chance = OPENS_CHANCE + (STAYS_CHANCE - OPENS_CHANCE) * opening.is_on
            added, weight = mixed(still, by_force + by_rate, chance)
            opening.likelihood = max(0.0, opening.likelihood + added)
            opening.rate_rad_s = (1.0 - misfit.rate_gain) * (weight * moved + (1.0 - weight) * idle)
            opening.before, opening.is_on = weight * turned, weight
            opening.thrust_s += weight * more * block.span_s

    def _sizes(self) -> NDArray[np.float64]:
        whole = self._squared + self._turn_squared
        return np.clip((self._force + self._turn) / np.maximum(whole, 1e-12), self._low, self._high)

    def _likelihoods(self, sizes: NDArray[np.float64]) -> NDArray[np.float64]:
        return sizes * (self._force + self._turn) - 0.5 * sizes**2 * (self._squared + self._turn_squared)

    def explanations(self) -> list[Explanation]:
        """All of them at their best moment, the likeliest first."""
        sizes = self._sizes()
        likelihoods = self._likelihoods(sizes)
        is_twice = np.zeros(likelihoods.shape, bool)
        for then in self._at_marks:
            is_twice |= (then >= self._witness) & (likelihoods - then >= self._witness)
        best = np.argmax(likelihoods, axis=0)
        found = []
        for column, slot in enumerate(best.tolist()):
            size = float(sizes[slot, column])
            squared = max(float(self._squared[slot, column]), 1e-12)
            turning = 0.5 * size**2 * float(self._turn_squared[slot, column])
            found.append(
                Explanation(
                    self._kind(column, size),
                    column % self._count if column < 3 * self._count else -1,
                    float(likelihoods[slot, column]),
                    bool(is_twice[slot, column]),
                    size,
                    abs(size) * float(self._thrust_s[slot, column]),
                    turning,
                    size * float(self._turn[slot, column]) - turning,
                    abs(float(self._cross[slot, column])) / squared / abs(size or 1.0),
                    1.0 / math.sqrt(squared) / abs(size or 1.0),
                )
            )
        y, x = found.pop(), found.pop()  # of a force that stays both components count
        both, twice = x.likelihood + y.likelihood, x.is_twice or y.is_twice
        found.append(x._replace(likelihood=both, is_twice=twice, size=math.hypot(x.size, y.size)))
        for valve, opening in enumerate(self._openings):
            so_far = [then[valve] for then in self._openings_at_marks]
            twice = any(
                then >= self._witness and opening.likelihood - then >= self._witness for then in so_far
            )
            alike = found[self._count + valve]  # direction and turning of thrust not commanded
            found.append(
                alike._replace(
                    likelihood=opening.likelihood,
                    is_twice=twice,
                    size=1.0,
                    thrust_s=opening.thrust_s,
                    is_steady=False,
                )
            )
        return sorted(found, key=lambda each: -each.likelihood)

    def _kind(self, column: int, size: float) -> Kind:
        if column < self._count:
            return Kind.CLOSED if size >= CLOSED_SHARE else Kind.WEAK
        if column < 2 * self._count:
            return Kind.OPEN
        if column < 3 * self._count:
            return Kind.WORKS
        return (Kind.SUPPLY, Kind.TIMING, Kind.TIMING, Kind.ZERO, Kind.ZERO)[column - 3 * self._count]


def mixed(off: float, on: float, chance: float) -> tuple[float, float]:
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
