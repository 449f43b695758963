"""What happened in a run and when, read from its recording: requests, failures, faults, landings."""

import json
from dataclasses import dataclass
from typing import Any

from groundstation.declarations.message import Message
from groundstation.declarations.request import Ack, Request
from groundstation.parts.laboratory.messages import InjectedFailure
from groundstation.parts.scenario.messages import Marker
from groundstation.parts.supervision.accounting import account_for
from groundstation.parts.supervision.messages import Faults, StopPress, Supervision
from groundstation.supervision.account import Account
from groundstation.supervision.modes import ALOFT
from groundstation.watch.verdict import (
    FAILURE,
    FAULT,
    MARKER,
    MODE,
    READ_FROM_RECORDING,
    REQUEST,
    RunEvent,
    Verdict,
)

TAKEN: tuple[type[Message], ...] = (
    Request, Ack, InjectedFailure, Faults, Supervision, StopPress, Marker,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Mark:
    """Something that is marked on every time axis.

    Attributes:
        t_s: When it began, s since the recording began.
        until_s: When it ended; None for a moment.
        kind: Word of ``verdict``.
        vehicle: Whom it befell; empty for all.
        text: For people, one line.
    """

    t_s: float
    until_s: float | None
    kind: str
    vehicle: str
    text: str

    def as_json(self, zero_s: float) -> dict[str, Any]:
        """The keys of ``report.json``, from the run's t = 0."""
        found = RunEvent(self.t_s - zero_s, self.kind, self.vehicle, self.text).as_json()
        return found if self.until_s is None else {**found, "until_s": self.until_s - zero_s}


class EventLog:
    """Takes the messages of ``TAKEN``, in the order of a recording."""

    def __init__(self) -> None:
        self._marks: list[Mark] = []
        self._accounts: dict[str, Account] = {}
        self._modes: dict[str, str] = {}
        self._asked: dict[tuple[str, int], tuple[float, Request]] = {}
        self._failures: dict[tuple[str, str, str], float] = {}
        self._presses: set[tuple[str, int]] = set()

    def take(self, message: Message, t_s: float) -> None:
        """Account for a message; of other classes nothing is made."""
        match message:
            case Request():
                self._asked[message.author, message.request_id] = t_s, message
            case Ack():
                self._answered(message, t_s)
            case InjectedFailure():
                self._failure(message, t_s)
            case StopPress():
                if (message.author, message.press_id) not in self._presses:
                    self._presses.add((message.author, message.press_id))
                    self._mark(t_s, REQUEST, message.vehicle, f"stop pressed by {message.author}")
            case Faults():
                account_for(self._accounts.setdefault(message.vehicle, Account()), message, t_s)
            case Supervision():
                self._mode(message, t_s)
            case Marker():
                self._mark(t_s, MARKER, "", message.text)

    def marks(self, end_s: float) -> list[Mark]:
        """Everything, in order; what lasted to the end has no end of its own.

        Args:
            end_s: When the recording ends.
        """
        found = list(self._marks)
        for t_s, request in self._asked.values():
            found.append(Mark(t_s, None, REQUEST, request.vehicle, f"{_asked(request)}: not answered"))
        for (vehicle, failure, parameters), t_s in self._failures.items():
            found.append(Mark(t_s, end_s, FAILURE, vehicle, _failed(failure, parameters)))
        for vehicle, account in self._accounts.items():
            for episode in account.episodes:
                detail = f" ({episode.detail})" if episode.detail else ""
                until_s = end_s if episode.until_s is None else episode.until_s
                text = f"{episode.id}{detail}: {episode.response}"
                found.append(Mark(episode.since_s, until_s, FAULT, vehicle, text))
        return sorted(found, key=lambda mark: mark.t_s)

    def _mark(self, t_s: float, kind: str, vehicle: str, text: str) -> None:
        self._marks.append(Mark(t_s, None, kind, vehicle, text))

    def _answered(self, ack: Ack, t_s: float) -> None:
        asked_s, request = self._asked.pop((ack.author, ack.request_id), (t_s, None))
        what = f"{ack.author}: {ack.action}" if request is None else _asked(request)
        words = "accepted" if ack.accepted else f"refused: {ack.reason}"
        self._mark(asked_s, REQUEST, ack.vehicle, f"{what}: {words}")

    def _failure(self, message: InjectedFailure, t_s: float) -> None:
        key = message.vehicle, message.failure, message.parameters
        if message.refusal:
            self._mark(t_s, FAILURE, message.vehicle, f"not injected: {message.refusal}")
        elif message.is_active:
            self._failures.setdefault(key, t_s)
        else:
            began_s = self._failures.pop(key, t_s)
            text = _failed(message.failure, message.parameters)
            self._marks.append(Mark(began_s, t_s, FAILURE, message.vehicle, text))

    def _mode(self, ruling: Supervision, t_s: float) -> None:
        """Take-offs and landings; what comes between is drawn as the row of modes."""
        before = self._modes.get(ruling.vehicle, "")
        self._modes[ruling.vehicle] = ruling.mode
        if before and (before in ALOFT) != (ruling.mode in ALOFT):
            self._mark(t_s, MODE, ruling.vehicle, f"{ruling.mode}: {ruling.cause}")


def with_verdict(marks: list[Mark], verdict: Verdict | None) -> list[Mark]:
    """Marks of the recording, and what else a verdict knows of."""
    if verdict is None:
        return marks
    added = [
        Mark(event.t_s + verdict.zero_s, None, event.kind, event.vehicle, event.text)
        for event in verdict.events
        if event.kind not in READ_FROM_RECORDING
    ]
    return sorted([*marks, *added], key=lambda mark: mark.t_s)


def _asked(request: Request) -> str:
    try:
        given = json.loads(request.arguments or "{}")
    except ValueError:
        given = {"arguments": request.arguments}
    return f"{request.author}: {request.action}{_in_brackets(given)}"


def _failed(failure: str, parameters: str) -> str:
    try:
        given = json.loads(parameters or "{}")
    except ValueError:
        given = {"parameters": parameters}
    return f"{failure}{_in_brackets(given)}"


def _in_brackets(given: Any) -> str:  # noqa: ANN401 any JSON value
    if not isinstance(given, dict) or not given:
        return ""
    words = [
        f"{key} = {value:.4g}" if isinstance(value, float) else f"{key} = {value}"
        for key, value in given.items()
        if value is not None
    ]
    return f" ({', '.join(words)})" if words else ""
