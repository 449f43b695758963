"""A guided calibration: what to do next, and when there is enough data.

The sequence knows nothing of devices. It takes what a filter knows by now (sigmas) and what the vehicle does,
and returns which step is due and what is missing. Steps are rows of a table.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from groundstation.declarations.guide import Advice, Goal, Step


class GuidedSequence:
    """Walks through the steps.

    Args:
        steps: the table.
    """

    def __init__(self, steps: tuple[Step, ...]) -> None:
        self._steps = steps
        self._number = -1
        self._since_s = 0.0
        self._base: Mapping[str, float] = MappingProxyType({})
        self.outcomes: dict[str, str] = {}
        """By step: "enough data", or what was missing when it was given up."""

    def update(self, now_s: float, known: Mapping[str, float]) -> Advice:
        """Judge what is known now.

        Args:
            now_s: any steady clock.
            known: quantities of the goals by name; amounts count from the beginning of the run.
        """
        if self._number < 0:
            return self._next(now_s, known)
        if self._number >= len(self._steps):
            return Advice(None, 1.0, "", is_new=False)
        step = self._steps[self._number]
        shares = {goal: goal.share(self._value(goal, known)) for goal in step.goals}
        worst = min(shares, key=lambda goal: shares[goal])
        if shares[worst] >= 1.0:
            self.outcomes[step.name] = "enough data"
            return self._next(now_s, known)
        missing = f"{worst.quantity} {self._value(worst, known):.3g} of {worst.limit:.3g} {worst.unit}"
        if now_s - self._since_s > step.longest_s:
            self.outcomes[step.name] = f"given up after {step.longest_s:g} s: {missing}"
            return self._next(now_s, known)
        return Advice(step, shares[worst], missing, is_new=False)

    def give_up(self, now_s: float, known: Mapping[str, float], why: str) -> Advice:
        """End the step for a reason, with what is known by now."""
        if 0 <= self._number < len(self._steps):
            self.outcomes[self._steps[self._number].name] = f"given up: {why}"
        return self._next(now_s, known)

    def _value(self, goal: Goal, known: Mapping[str, float]) -> float:
        value = known.get(goal.quantity, 0.0 if goal.is_amount else float("inf"))
        return value - self._base.get(goal.quantity, 0.0) if goal.is_amount else value

    def _next(self, now_s: float, known: Mapping[str, float]) -> Advice:
        ended = ""
        if self._number >= 0 and self._number < len(self._steps):
            name = self._steps[self._number].name
            ended = f"{name}: {self.outcomes[name]}"
        self._number = min(self._number + 1, len(self._steps))
        self._since_s = now_s
        self._base = MappingProxyType(dict(known))
        if self._number >= len(self._steps):
            return Advice(None, 1.0, "", is_new=True, ended=ended)
        return Advice(self._steps[self._number], 0.0, "", is_new=True, ended=ended)
