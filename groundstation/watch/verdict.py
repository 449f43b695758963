"""The verdict on a run: what a report shows of a scenario's limits and of what happened."""

from dataclasses import dataclass

PASSED, FAILED, ERROR = "passed", "failed", "error"


@dataclass(frozen=True, slots=True)
class LimitOutcome:
    """What became of one limit.

    Attributes:
        what: The quantity, its unit in its name.
        vehicles: Whom it concerns.
        value: Of the quantity; NaN where it could not be had, infinite where it never came.
        below, above: The limit; one of them or both.
        held: Whether it held.
        at_s: When the value was reached, s from t = 0.
    """

    what: str
    vehicles: tuple[str, ...]
    value: float
    below: float | None
    above: float | None
    held: bool
    at_s: float


@dataclass(frozen=True, slots=True)
class RunEvent:
    """Something that happened in a run.

    Attributes:
        t_s: When, s from t = 0.
        kind: ``request``, ``failure``, ``fault``, ``marker`` or ``mode``.
        vehicle: Whose; empty for the rig's.
        text: For people.
    """

    t_s: float
    kind: str
    vehicle: str
    text: str


@dataclass(frozen=True, slots=True)
class Verdict:
    """The verdict on a run.

    Attributes:
        verdict: ``passed``, ``failed`` or ``error``.
        reason: Why it is not passed, a sentence; empty otherwise.
        limits: All of the scenario.
        events: In order.
        zero_s: When t = 0 of the scenario is, s since the recording began.
    """

    verdict: str
    reason: str
    limits: tuple[LimitOutcome, ...]
    events: tuple[RunEvent, ...]
    zero_s: float
