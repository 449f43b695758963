"""A guided calibration whose steps are walked through: what all of them answer in the same way."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping

from calibration.guided_steps import GuidedSteps
from groundstation.declarations.guide import Advice, Wish


class SteppedGuide(ABC):
    """Passes on to its steps what is asked of them; a guide adds its data, pictures and result.

    Attributes:
        steps: Walks the vehicle through.

    Args:
        steps: See there.
    """

    def __init__(self, steps: GuidedSteps) -> None:
        self.steps = steps

    @abstractmethod
    def known(self) -> Mapping[str, float]:
        """The quantities of the goals beyond those of `GuidedSteps`, by their names."""

    @property
    def outcomes(self) -> dict[str, str]:
        """How each step ended."""
        return self.steps.outcomes

    def advice(self, now_s: float) -> Advice:
        """Return what to do now."""
        return self.steps.advice(now_s, self.known())

    def hindrance(self) -> str:
        """Return why the calibration cannot begin yet; empty if it can."""
        return self.steps.hindrance()

    def trouble(self) -> str:
        """Return why it ends early: somebody else has taken the vehicle; empty if nobody has."""
        return self.steps.trouble()

    def answer(self, action: str, reason: str) -> None:
        """Note what became of a request; a refusal, with its reason, ends the step."""
        self.steps.answer(action, reason)

    def requests(self, now_s: float) -> Iterator[Wish]:
        """Yield what the step of the last advice wants the vehicle to do, now and then."""
        return self.steps.requests(now_s)
