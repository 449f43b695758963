"""What a part shows of a vehicle: gauges for the live view, figures for the report.

A gauge takes messages and answers with a short text; whoever shows it knows nothing of the messages.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, ClassVar, TypeVar

from numpy.typing import NDArray

from groundstation.declarations.message import Message

Array = NDArray[Any]
Wanted = Mapping[type[Message], tuple[str, ...]]
RATE_WINDOW_S = 3.0
M = TypeVar("M", bound=Message)


class Level(Enum):
    """How a text is to be shown."""

    PLAIN = "plain"
    GOOD = "good"
    WARNING = "warning"
    BAD = "bad"
    FAINT = "faint"


@dataclass(frozen=True, slots=True)
class Cell:
    """A text of several pieces, each with its level."""

    pieces: tuple[tuple[str, Level], ...] = ()

    def __add__(self, other: "Cell") -> "Cell":
        return Cell(self.pieces + other.pieces)

    @property
    def text(self) -> str:
        """Without levels."""
        return "".join(piece for piece, _ in self.pieces)


def cell(text: str, level: Level = Level.PLAIN) -> Cell:
    """A cell of one piece."""
    return Cell(((text, level),))


NOTHING = cell("-", Level.FAINT)
"""What is shown where nothing is known yet."""


@dataclass(slots=True)
class Newest:
    """What is known of one vehicle: the newest message of each class, and how often they come."""

    _messages: dict[type[Message], Message] = field(default_factory=dict)
    _stamps_ns: dict[type[Message], deque[int]] = field(default_factory=dict)

    def put(self, message: Message) -> None:
        """Take a message."""
        self._messages[type(message)] = message

    def count(self, kind: type[Message], now_ns: int) -> None:
        """One more message of a class."""
        stamps_ns = self._stamps_ns.setdefault(kind, deque())
        stamps_ns.append(now_ns)
        while now_ns - stamps_ns[0] > RATE_WINDOW_S * 1e9:
            stamps_ns.popleft()

    def get(self, kind: type[M]) -> M | None:
        """The newest message of a class."""
        found = self._messages.get(kind)
        return found if isinstance(found, kind) else None

    def rate_hz(self, kind: type[Message], now_ns: int) -> float:
        """Messages per second over the last seconds; 0 when silent."""
        stamps_ns = self._stamps_ns.get(kind)
        if stamps_ns is None:
            return 0.0
        while stamps_ns and now_ns - stamps_ns[0] > RATE_WINDOW_S * 1e9:
            stamps_ns.popleft()
        return len(stamps_ns) / RATE_WINDOW_S


class Gauge(ABC):
    """A row of the view for one vehicle.

    Class attributes:
        label: Of the row, empty for a gauge that only reports events.
        every: Classes of which it takes each message.
        newest: Classes of which it wants the newest when it is looked at.
        rated: Classes whose rate it shows.
    """

    label: ClassVar[str] = ""
    every: ClassVar[tuple[type[Message], ...]] = ()
    newest: ClassVar[tuple[type[Message], ...]] = ()
    rated: ClassVar[tuple[type[Message], ...]] = ()

    def __init__(self, vehicle: str) -> None:
        self.vehicle = vehicle

    def take(self, message: Message, now_ns: int) -> Iterable[str]:
        """Account for a message of ``every``; return events for people, one line each."""
        del message, now_ns
        return ()

    def look(self, newest: Newest, now_ns: int) -> Iterable[str]:
        """Called some times a second; return events for people, one line each."""
        del newest, now_ns
        return ()

    @abstractmethod
    def cell(self, newest: Newest, now_ns: int) -> Cell:
        """What the row shows now."""

    def phrase(self, newest: Newest, now_ns: int) -> str:
        """Its share of the vehicle's line in a log, of fixed width; empty for none."""
        del newest, now_ns
        return ""


@dataclass(frozen=True, slots=True)
class GaugeRow:
    """A gauge as its part declares it.

    Attributes:
        order: Place in the view, ascending.
        make: Makes it for a vehicle.
    """

    order: int
    make: Callable[[str], Gauge]


class Figure(ABC):
    """Numbers of one vehicle in ``report.json``.

    Class attributes:
        inputs: Classes of which it takes each recorded message.
        columns: Classes whose messages come too often for that, and the fields of which it takes arrays.
    """

    inputs: ClassVar[tuple[type[Message], ...]] = ()
    columns: ClassVar[Wanted] = {}

    def take(self, message: Message, t_s: float) -> None:
        """Account for a message of ``inputs``; times count from the start of the recording."""
        del message, t_s

    def take_columns(self, kind: type[Message], t_s: Array, fields: Mapping[str, Array]) -> None:
        """Account for all messages of a class of ``columns``; called once, after the messages.

        Args:
            kind: The class.
            t_s: Stamps, ascending; shape (n,).
            fields: By name, shape (n,) or (n, k); texts as bytes.
        """
        del kind, t_s, fields

    @abstractmethod
    def values(self) -> dict[str, Any]:
        """Keys with units, and numbers, texts, lists or tables of these."""
