"""What people are shown of how a vehicle is run: the phase of its start sequence, requests refused."""

from collections.abc import Iterator

from groundstation.declarations.message import Message
from groundstation.declarations.request import Ack
from groundstation.declarations.view import NOTHING, Cell, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.operation.messages import SequencePhase

_LEVELS = {"flying": Level.GOOD, "stopped": Level.BAD, "disarmed": Level.WARNING}


class PhaseGauge(Gauge):
    """Where the start sequence is; each phase and each refusal of a request is an event."""

    label = "phase"
    every = (SequencePhase, Ack)
    newest = (SequencePhase,)

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        if isinstance(message, SequencePhase):
            yield f"{self.vehicle}: {_words(message)}"
        elif isinstance(message, Ack) and not message.accepted:
            yield f"{self.vehicle}: {message.action} refused: {message.reason}"

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        phase = newest.get(SequencePhase)
        return NOTHING if phase is None else cell(_words(phase), _LEVELS.get(phase.phase, Level.PLAIN))

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del now_ns
        phase = newest.get(SequencePhase)
        return f"{'-' if phase is None else phase.phase:<16}"


def _words(phase: SequencePhase) -> str:
    return phase.phase + (f" ({phase.detail})" if phase.detail else "")


GAUGES = (GaugeRow(10, PhaseGauge),)
