"""What people are shown first: the mode of a vehicle and its faults; each change is an event."""

from collections.abc import Iterator

from groundstation.declarations.message import Message
from groundstation.declarations.request import Ack
from groundstation.declarations.view import NOTHING, Cell, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.supervision.learned import LearnedGauge
from groundstation.parts.supervision.messages import Faults, Supervision

_LEVELS = {
    "flying": Level.GOOD,
    "landed": Level.PLAIN,
    "resting": Level.PLAIN,
    "armed": Level.PLAIN,
    "lost": Level.BAD,
    "stopped": Level.BAD,
}


class ModeGauge(Gauge):
    """The mode and why; each change and each refusal of a request is an event."""

    label = "mode"
    every = (Supervision, Ack)
    newest = (Supervision,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._shown = ""

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        if isinstance(message, Supervision):
            words = _words(message)
            if words != self._shown:
                self._shown = words
                yield f"{self.vehicle}: {words}"
        elif isinstance(message, Ack) and not message.accepted:
            yield f"{self.vehicle}: {message.action} refused: {message.reason}"

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        ruling = newest.get(Supervision)
        if ruling is None:
            return NOTHING
        waits = f"; waits for {ruling.waits_for[0]}" if ruling.waits_for else ""
        return cell(_words(ruling) + waits, _LEVELS.get(ruling.mode, Level.WARNING))

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del now_ns
        ruling = newest.get(Supervision)
        return f"{'-' if ruling is None else ruling.mode:<9}"


def _words(ruling: Supervision) -> str:
    whose = f", by {ruling.author}" if ruling.author else ""
    return f"{ruling.mode} ({ruling.cause}{whose})"


class FaultGauge(Gauge):
    """Faults that stand; beginning and end of each are events."""

    label = "faults"
    every = (Faults,)
    newest = (Faults,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._there: dict[str, bool] = {}

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, Faults)
        there = {}
        for row, fault in enumerate(message.ids):
            there[fault] = message.gone_ns[row] == 0.0
            if there[fault] and not self._there.get(fault):
                detail = f" ({message.details[row]})" if message.details[row] else ""
                yield (
                    f"{self.vehicle}: FAULT {fault}: {message.whats[row]}{detail} "
                    f"It {message.responses[row]}. {message.advices[row]}"
                )
        for fault, was_there in self._there.items():
            if was_there and not there.get(fault):
                yield f"{self.vehicle}: fault {fault} is gone" + (
                    "; release clears it" if fault in there else ""
                )
        self._there = there

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        faults = newest.get(Faults)
        if faults is None:
            return NOTHING
        if not faults.ids:
            return cell("none", Level.GOOD)
        shown = []
        for row, fault in enumerate(faults.ids):
            age_s = (now_ns - faults.since_ns[row]) * 1e-9
            is_there = faults.gone_ns[row] == 0.0
            state = f"{age_s:.0f} s, {faults.responses[row]}" if is_there else "gone, release clears it"
            shown.append(f"{fault} ({state})")
        return cell(", ".join(shown), Level.BAD)

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del now_ns
        faults = newest.get(Faults)
        count = 0 if faults is None else len(faults.ids)
        return f"{f'FAULTS {count}' if count else 'no faults':<9}"


GAUGES = (GaugeRow(1, ModeGauge), GaugeRow(2, FaultGauge), GaugeRow(125, LearnedGauge))
