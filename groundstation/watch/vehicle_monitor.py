"""One vehicle as it is watched: its gauges, and the newest messages that they look at."""

from collections.abc import Callable, Iterable
from typing import TypeVar

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.declarations.message import Message
from groundstation.declarations.view import Cell, Gauge, Level, Newest, cell

T = TypeVar("T")
_FAILED = cell("failed", Level.BAD)

Garbled = Callable[[str, str, CodecError], None]
"""Takes owner and noun of a message that cannot be decoded."""


class VehicleMonitor:
    """Rows and events of one vehicle.

    A gauge may come from somebody's package: one that fails is reported once and shows that it failed; the
    process that watches also supervises the flight.

    Args:
        name: Of the vehicle.
        gauges: In the order of the view.
        note: Takes events.
        garbled: Called for bytes that cannot be decoded; the value before stays.

    Attributes:
        name: Of the vehicle.
        gauges: In the order of the view.
        newest: The newest messages, as of the last ``refresh``.
        undecoded: Bytes of newer ones.
        is_known: Whether anything came from the vehicle.
    """

    def __init__(
        self, name: str, gauges: tuple[Gauge, ...], note: Callable[[str], None], garbled: Garbled
    ) -> None:
        self.name = name
        self.gauges = gauges
        self._rows = tuple(gauge for gauge in gauges if gauge.label)
        self._note = note
        self._garbled = garbled
        self.newest = Newest()
        self.undecoded: dict[type[Message], bytes] = {}
        self.is_known = False
        self._failed: set[Gauge] = set()

    def labels(self) -> tuple[str, ...]:
        """Of the rows."""
        return tuple(gauge.label for gauge in self._rows)

    def rows(self, now_ns: int) -> list[Cell]:
        """Cells in the order of ``labels``."""
        self.refresh()
        return [self._try(gauge, _FAILED, gauge.cell, self.newest, now_ns) for gauge in self._rows]

    def line(self, now_ns: int) -> str:
        """The most important of it in one line of fixed columns."""
        self.refresh()
        phrases = [self._try(gauge, "", gauge.phrase, self.newest, now_ns) for gauge in self.gauges]
        return "  ".join(phrase for phrase in phrases if phrase)

    def look(self, now_ns: int) -> list[str]:
        """What the gauges find silent or wrong: events."""
        self.refresh()
        found: list[str] = []
        for gauge in self.gauges:
            found += self._try(gauge, (), _events, gauge.look, self.newest, now_ns)
        return found

    def take(self, gauges: Iterable[Gauge], payload: Message, now_ns: int) -> list[str]:
        """Hand a message to those gauges of this vehicle that take each: events."""
        found: list[str] = []
        for gauge in gauges:
            found += self._try(gauge, (), _events, gauge.take, payload, now_ns)
        return found

    def refresh(self) -> None:
        """Decode what came since somebody looked last."""
        for kind, data in self.undecoded.items():
            try:
                self.newest.put(codec_of(kind).decode(data))
            except CodecError as error:
                self._garbled(self.name, kind.TOPIC.noun, error)
        self.undecoded.clear()

    def _try(self, gauge: Gauge, otherwise: T, ask: Callable[..., T], *about: object) -> T:
        if gauge in self._failed:
            return otherwise
        try:
            return ask(*about)
        except (Exception, SystemExit) as error:  # of somebody else: it is noted, the view goes on
            self._failed.add(gauge)
            self._note(f"{self.name}: {type(gauge).__name__} failed: {type(error).__name__}: {error}")
            return otherwise


def _events(ask: Callable[..., Iterable[str]], *about: object) -> tuple[str, ...]:
    """All of them at once: a generator fails while it runs."""
    return tuple(ask(*about))
