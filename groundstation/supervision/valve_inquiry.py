"""From an alarm to a verdict: two stretches of time must speak for the same explanation."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from groundstation.control.valve_health import (
    MOST_SHARE,
    STUCK_CLOSED,
    ValveHealth,
    leaking,
    stuck_open,
    weak,
)
from groundstation.supervision.finding import Finding
from groundstation.supervision.thrust_blocks import Block
from groundstation.supervision.thrust_fit import Misfit, ThrustFit
from groundstation.supervision.valve_hypotheses import Suspicion
from groundstation.supervision.valve_trial import CLOSED_SHARE, Explanation, Kind, ValveTrial

SURE = 7.0
"""Of two explanations the better one is named alone when it is e^7 = 1100 times as likely."""
HISTORY_S = 10.0
"""So far back a fault may have begun, and so long an alarm waits for a second witness."""
_WITNESS = 0.5
"""Of the threshold: what each of two stretches of time gives."""
_WHOLE = 1.5
"""Of the threshold: what both give together."""
_TURN_KNOWN = 8.0
"""The gyro has a say about thrust not commanded when it would have given this much."""
_ACROSS = 0.35
_MANY = 3


class Verdict(NamedTuple):
    """What it was.

    Attributes:
        best: The likeliest explanation.
        rivals: Those of other valves that cannot be told apart from it.
        is_hand: A force that no valve gives.
    """

    best: Explanation
    rivals: tuple[Explanation, ...]
    is_hand: bool

    @property
    def whose(self) -> str:
        """The valve in words."""
        return f"valve {self.best.valve}"

    def findings(self) -> tuple[Finding, ...]:
        """The fault in words; not for hands. What may as well be a valve that does not shut is said to be."""
        open_too = [
            each for each in self.rivals if each.kind is Kind.OPEN and self.best.kind is not Kind.OPEN
        ]
        found = self._finding(self.best, self.rivals)
        return (found, *(self._finding(each, (self.best,)) for each in open_too[:1]))

    def health(self) -> dict[int, ValveHealth]:
        """What the valve gives now, by its number.

        Nothing is known of those that cannot be told apart, nor of one that opens now and then.
        """
        best = self.best
        if best.valve < 0 or self.rivals or not best.is_steady:
            return {}
        if best.kind is Kind.OPEN:
            share = min(best.size, MOST_SHARE)
            return {best.valve: stuck_open(share) if share >= CLOSED_SHARE else leaking(share)}
        return {best.valve: STUCK_CLOSED if best.kind is Kind.CLOSED else weak(1.0 - best.size)}

    def _finding(self, best: Explanation, rivals: tuple[Explanation, ...]) -> Finding:
        if best.kind is Kind.SUPPLY:
            return Finding(
                Kind.WEAK.value, "all valves at half thrust or less: supply pressure", "all valves"
            )
        part = "a part of its" if best.size < 1.0 - _ACROSS else "its"
        what = {
            Kind.CLOSED: "gives no thrust when commanded",
            Kind.WEAK: f"gives {1.0 - best.size:.0%} of its thrust",
            Kind.OPEN: f"gives {part} thrust that was not commanded",
        }[best.kind]
        detail = f"valve {best.valve} {what} ({best.thrust_s:.2f} s of it)"
        others = sorted({f"{each.valve} ({each.kind.value})" for each in rivals})
        if others:
            detail += f"; cannot be told apart from valve {', '.join(others)}"
        return Finding(best.kind.value, detail, f"valve {best.valve}")


class ValveInquiry:
    """Keeps blocks, opens a trial at an alarm, closes it with a verdict or without.

    Args:
        fit: Knows what each valve does.
        threshold: Evidence that is an alarm.
        block_s: Length of a block.
        wait_s: How long to wait for more evidence when two valves could explain it.
    """

    def __init__(self, fit: ThrustFit, threshold: float, block_s: float, wait_s: float) -> None:
        self._fit, self._threshold = fit, threshold
        self._patience, self._longest = round(wait_s / block_s), round(HISTORY_S / block_s)
        self._number = 0
        self._blocks: deque[tuple[int, Block, Misfit]] = deque(maxlen=self._longest)
        self.forget()

    def forget(self) -> None:
        """Begin anew: what was felt so far has been explained, or explains nothing."""
        self._blocks.clear()
        self._onsets: list[int] = []
        self._marks: list[int] = []
        self._trial: ValveTrial | None = None
        self._waited = 0

    @property
    def is_open(self) -> bool:
        """Whether an alarm waits for its verdict."""
        return self._trial is not None

    def take(self, block: Block, misfit: Misfit) -> None:
        """Take a block."""
        self._number += 1
        self._blocks.append((self._number, block, misfit))
        if self._trial is None:
            return
        if self._number - self._marks[-1] > self._longest:
            self.forget()  # nothing agreed with it
            return
        self._trial.add(self._number, block, misfit)

    def alarm(self, cases: Sequence[Suspicion]) -> None:
        """A case reached the threshold: open a trial, or open it again with what is suspected now."""
        strong = [case for case in cases if case.evidence >= _WITNESS * self._threshold]
        earliest = self._blocks[0][0]
        self._onsets += [max(earliest, self._number - case.blocks + 1) for case in strong]
        self._onsets = [onset for onset in self._onsets if onset >= earliest]
        self._marks = [mark for mark in self._marks if mark >= earliest] + [self._number]
        self._trial = ValveTrial(
            self._fit, self._blocks, self._onsets, self._marks, _WITNESS * self._threshold
        )

    def _without_supply(self, explanations: list[Explanation]) -> list[Explanation]:
        """A supply that fails shows in valves one by one: of fewer than three it is not believed."""
        least = _WHOLE * self._threshold
        ill = {
            each.valve
            for each in explanations
            if each.kind in (Kind.WEAK, Kind.CLOSED) and each.likelihood >= least
        }
        return [each for each in explanations if each.kind is not Kind.SUPPLY or len(ill) >= _MANY]

    def verdict(self) -> Verdict | None:
        """What it was, once that is clear or the wait for clearness is over."""
        if self._trial is None:
            return None
        explanations = self._without_supply(self._trial.explanations())
        best = explanations[0]
        if best.likelihood < _WHOLE * self._threshold or not best.is_twice:
            self._waited = 0
            return None
        rivals = tuple(
            each
            for each in explanations[1:]
            if each.valve != best.valve and each.likelihood > best.likelihood - SURE
        )
        is_known = best.kind is not Kind.OPEN or best.turning >= _TURN_KNOWN  # else it may be a hand
        if (rivals or not is_known) and self._waited < self._patience:
            self._waited += 1
            return None
        self.forget()
        if best.kind is Kind.TIMING:
            return None
        zero = next((each for each in rivals if each.kind is Kind.ZERO), None)
        if zero is not None and best.kind is Kind.OPEN:
            best, rivals = zero, ()  # a valve that gives a little turns, too: that it did not show
        turns_otherwise = best.turning >= _TURN_KNOWN and best.by_rate < -0.5 * best.turning
        is_across = best.across > _ACROSS + 3.0 * best.across_sigma
        others = tuple(each for each in rivals if each.valve >= 0)
        if best.kind is Kind.SUPPLY and others:  # where one valve alone was commanded, it may be that one
            best, others = others[0], others[1:]
        return Verdict(best, others, best.kind is Kind.OPEN and (turns_otherwise or is_across))
