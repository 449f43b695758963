"""What became of a scenario, as its report shows it: the verdict, each limit, what happened when.

Whoever judges a run makes these; the report only prints them. Times count from the scenario's t = 0.
"""

from dataclasses import dataclass
from typing import Any, Final

PASSED: Final = "passed"
FAILED: Final = "failed"
ERROR: Final = "error"

REQUEST: Final = "request"
FAILURE: Final = "failure"
FAULT: Final = "fault"
MODE: Final = "mode"
MARKER: Final = "marker"
READ_FROM_RECORDING: Final = frozenset({REQUEST, FAILURE, FAULT, MODE, MARKER})
"""Kinds that a report reads from the recording itself; of a verdict it takes events of any other kind."""


@dataclass(frozen=True, slots=True)
class LimitOutcome:
    """One limit and how it was kept.

    Attributes:
        what: Quantity with its unit, such as ``position_error_rms_mm``.
        vehicles: Whom it is about; empty for the whole run.
        value: What was reached; NaN where nothing could be measured.
        below: It had to stay below this; None for the other kind.
        above: It had to stay above this; None for the other kind.
        held: Whether it did.
        at_s: When the value was reached, s from t = 0; NaN where it has no moment.
    """

    what: str
    vehicles: tuple[str, ...]
    value: float
    below: float | None
    above: float | None
    held: bool
    at_s: float

    def as_json(self) -> dict[str, Any]:
        """The keys of ``report.json``: one vehicle under ``vehicle``, several under ``vehicles``."""
        whose: dict[str, Any] = (
            {"vehicle": self.vehicles[0]} if len(self.vehicles) == 1 else {"vehicles": list(self.vehicles)}
        )
        bounds = {"below": self.below, "above": self.above}
        return {
            "what": self.what,
            **whose,
            "value": self.value,
            **{key: bound for key, bound in bounds.items() if bound is not None},
            "held": self.held,
            "at_s": self.at_s,
        }


@dataclass(frozen=True, slots=True)
class RunEvent:
    """Something that happened at a moment of the run.

    Attributes:
        t_s: When, s from t = 0; negative before it.
        kind: One of this file's words, or any other, which is shown as it is.
        vehicle: Whom it befell; empty for all.
        text: For people, one line.
    """

    t_s: float
    kind: str
    vehicle: str
    text: str

    def as_json(self) -> dict[str, Any]:
        """The keys of ``report.json``."""
        return {"t_s": self.t_s, "kind": self.kind, "vehicle": self.vehicle, "text": self.text}


@dataclass(frozen=True, slots=True)
class Verdict:
    """What a run is judged to be.

    Attributes:
        verdict: ``passed``, ``failed`` or ``error``.
        reason: Why it is not ``passed``, one sentence; empty for a run that passed.
        limits: In the order of the scenario.
        events: Of kinds that a recording does not hold by itself; in any order.
        zero_s: When the scenario's t = 0 was, s since the recording began.
        title: Of the report; empty for the name of the recording.
        obstacles: x, y and radius (m, table frame) of each that stands on the table.
    """

    verdict: str
    reason: str
    limits: tuple[LimitOutcome, ...] = ()
    events: tuple[RunEvent, ...] = ()
    zero_s: float = 0.0
    title: str = ""
    obstacles: tuple[tuple[float, float, float], ...] = ()
