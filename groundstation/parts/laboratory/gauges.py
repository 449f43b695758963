"""What is shown of injected failures: an event when one begins, ends or is refused."""

import json
from collections.abc import Iterable

from groundstation.declarations.message import Message
from groundstation.declarations.view import NOTHING, Cell, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.laboratory.messages import InjectedFailure


class FailureGauge(Gauge):
    """The failures that are there now."""

    label = "injected"
    every = (InjectedFailure,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._active: dict[tuple[str, str], str] = {}

    def take(self, message: Message, now_ns: int) -> Iterable[str]:
        assert isinstance(message, InjectedFailure)
        if message.refusal:
            return ()
        words = _words(message)
        key = (message.failure, message.parameters)
        if message.is_active:
            self._active[key] = words
            return (f"{message.vehicle}: the laboratory injects {words}",)
        self._active.pop(key, None)
        return (f"{message.vehicle}: the laboratory ends {words}",)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        return cell(", ".join(self._active.values()), Level.WARNING) if self._active else NOTHING


def _words(message: InjectedFailure) -> str:
    given = json.loads(message.parameters)
    shown = ", ".join(f"{name} {value:g}" for name, value in given.items() if value is not None)
    return message.failure.replace("_", " ") + (f" ({shown})" if shown else "")


GAUGES = (GaugeRow(130, FailureGauge),)
