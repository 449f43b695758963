"""One guided calibration that the console leads: from its start to accept or discard."""

import math
import threading
from collections.abc import Iterable, Mapping
from enum import StrEnum
from typing import Any

from groundstation.declarations.guide import Advice, Drawing, Found, Guide, Number
from groundstation.declarations.message import Message
from groundstation.declarations.request import Ack, Request
from groundstation.launch.guided import ADVICE_PERIOD_NS, GuideNode

DIGITS = 6
"""Of what is drawn: a screen has no more pixels."""
MOST_LINES = 20


class State(StrEnum):
    """Where it is."""

    COLLECTING = "collecting"
    FITTING = "fitting"
    RESULT = "result"
    ENDED = "ended"
    SAVED = "saved"


class Session:
    """Leads a guide; its methods are called from one thread at a time, beside the event loop.

    Args:
        name: Of the wizard.
        vehicle: Which one.
        guide: The calibration.
        author: Who began it.
        is_driven: Whether the vehicle is asked for what each step needs.

    Attributes:
        state: Where it is.
        trouble: Why it ended without a result.
        found: The result.
        saved: Where it was written.
    """

    def __init__(self, name: str, vehicle: str, guide: Guide, author: str, *, is_driven: bool) -> None:
        self.name, self.vehicle, self.author, self.is_driven = name, vehicle, author, is_driven
        self.guide = guide
        self.state = State.COLLECTING
        self.trouble = ""
        self.found: Found | None = None
        self.saved: tuple[str, ...] = ()
        self._node = GuideNode(vehicle, guide, self._advise, author if is_driven else "")
        self._due_ns: int | None = None
        self._advice: Advice | None = None
        self._lines: list[str] = []
        self._pictures: list[dict[str, Any]] = []
        self._lock = threading.Lock()

    def go_on(self, messages: Iterable[Message], answers: Iterable[Ack], now_ns: int) -> list[Request]:
        """Take what has come until a moment; what the vehicle is to be asked for.

        Args:
            messages: Of the guide's kinds, in the order of their stamps.
            answers: To earlier requests.
            now_ns: That moment.
        """
        for message in (*messages, *answers):
            list(self._node.receive(message, max(message.stamp_ns, now_ns - ADVICE_PERIOD_NS)))
        if self._due_ns is not None and now_ns < self._due_ns:
            return []
        self._due_ns = now_ns + ADVICE_PERIOD_NS
        wanted = [asked for asked in self._node.tick(now_ns) if isinstance(asked, Request)]
        pictures = [drawn(picture) for picture in self.guide.pictures()]
        with self._lock:
            self._pictures = pictures
            if self._node.is_done:
                self.trouble = self._node.trouble
                self.state = State.ENDED if self.trouble else State.FITTING
        return wanted

    def end(self, trouble: str) -> None:
        """End it without a result."""
        with self._lock:
            self.trouble, self.state = trouble, State.ENDED

    def fit(self) -> None:
        """Make the result; takes long."""
        try:
            found = self.guide.outcome()
        except ValueError as error:
            self.end(f"{error}.")
            return
        with self._lock:
            self.found, self.state = found, State.RESULT

    def page(self) -> dict[str, Any]:
        """What screens are sent of it."""
        with self._lock:
            advice, step = self._advice, None if self._advice is None else self._advice.step
            return {
                "name": self.name,
                "vehicle": self.vehicle,
                "author": self.author,
                "is_driven": self.is_driven,
                "state": str(self.state),
                "trouble": self.trouble,
                "step": None if step is None else {"name": step.name, "instruction": step.instruction},
                "done": 0.0 if advice is None else advice.done,
                "missing": "" if advice is None else advice.missing,
                "note": "" if advice is None else advice.note,
                "lines": list(self._lines),
                "pictures": self._pictures,
                "result": None if self.found is None else shown(self.found),
                "saved": list(self.saved),
            }

    def _advise(self, advice: Advice) -> None:
        with self._lock:
            self._advice = advice
            if advice.ended:
                self._lines = [*self._lines, advice.ended][-MOST_LINES:]


def drawn(picture: Drawing) -> dict[str, Any]:
    """A drawing as JSON can hold it."""
    return {
        "title": picture.title,
        "x_label": picture.x_label,
        "y_label": picture.y_label,
        "to_scale": picture.is_to_scale,
        "downwards": picture.is_downwards,
        "curves": [
            {
                "name": curve.name,
                "mark": curve.mark,
                "x": _short(curve.x, _origin(picture)),
                "y": _short(curve.y),
                "sigma": _short(curve.sigma),
            }
            for curve in picture.curves
        ],
    }


def shown(found: Found) -> dict[str, Any]:
    """A result as JSON can hold it."""
    return {
        "title": found.title,
        "summary": found.summary,
        "quantities": _rows(found.quantities),
        "residual": _rows(found.residual),
        "verification": _rows(found.verification),
        "verified_by": found.verified_by,
        "warnings": list(found.warnings),
        "drawings": [drawn(picture) for picture in found.drawings],
    }


def _rows(numbers: Mapping[str, Number]) -> list[list[object]]:
    return [
        [name, number.value, None if math.isnan(number.sigma) else number.sigma, number.unit]
        for name, number in numbers.items()
    ]


def _origin(picture: Drawing) -> float:
    """Times of the host's clock are long numbers: they count from the first that is drawn."""
    if not picture.x_label.startswith("time"):
        return 0.0
    return min((x for curve in picture.curves for x in curve.x), default=0.0)


def _short(values: Iterable[float], origin: float = 0.0) -> list[float]:
    return [float(f"{value - origin:.{DIGITS}g}") for value in values]
