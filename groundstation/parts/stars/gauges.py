"""What people are shown of the star tracker: pictures refused, stars that died, moved or appeared."""

from collections.abc import Iterator

from groundstation.declarations.message import Message
from groundstation.declarations.readings import counts_cell
from groundstation.declarations.view import NOTHING, Cell, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.stars.messages import SkyChange, StarFix

_CONSEQUENCE = {
    "died": ", no longer used",
    "moved": ", no longer used",
    "revived": ", used again",
    "returned": ", used again",
    "appeared": ", proposed for the catalogue",
    "vanished": ", no longer proposed",
}


class RefusalGauge(Gauge):
    """Why there is no fix now, and how often each reason was given."""

    label = "  refused"
    every = (StarFix,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._refused: dict[str, int] = {}
        self._now = ""

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, StarFix)
        self._now = ""
        if not message.fix:
            self._now = message.reason.partition(":")[0]  # its kind
            self._refused[self._now] = self._refused.get(self._now, 0) + 1
        yield from ()

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        if not self._refused:
            return NOTHING
        counts = counts_cell(self._refused)
        return cell(f"now: {self._now}; ", Level.BAD) + counts if self._now else counts

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del newest, now_ns
        return f"no fix: {self._now} ({self._refused[self._now]} x)" if self._now else ""


class SkyGauge(Gauge):
    """Reports what changed in the sky, and what follows from it."""

    every = (SkyChange,)

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, SkyChange)
        star = f"star {message.star}" if message.star else "a light that is no star"
        yield (
            f"{self.vehicle}: {star} {message.change} at ({message.x_m:.3f}, {message.y_m:.3f}) m"
            f"{_CONSEQUENCE.get(message.change, '')}"
        )

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        return NOTHING


GAUGES = (GaugeRow(110, RefusalGauge), GaugeRow(150, SkyGauge))
