"""What a topic is: where a payload belongs, how often it comes, what may be lost of it.

A payload class carries its topic (``TOPIC``): one class per topic, one publisher per owner. From it follow
the bus key, the recorder's channel, the queue policy of slow consumers and the order at equal stamps.
"""

from dataclasses import dataclass
from enum import Enum, IntEnum, auto


class Scope(Enum):
    """Whose a topic is."""

    VEHICLE = auto()
    RIG = auto()
    PROCESS = auto()


class Delivery(Enum):
    """What may be lost on the way."""

    EVERY = auto()  # nothing: the publisher waits
    NEWEST = auto()  # a slow consumer sees only the newest


class Recorded(Enum):
    """Whether the recorder keeps it, by the rig's image policy."""

    ALWAYS = auto()
    SPOTS = auto()  # unless images are off
    IMAGES = auto()  # only where images are kept


class Rank(IntEnum):
    """What is judged first at equal stamps in virtual time: requests and valves before sensors."""

    REQUEST = 0
    VALVES = 10
    SENSOR = 20
    ESTIMATE = 30
    COMMAND = 40
    REPORT = 50


@dataclass(frozen=True, slots=True)
class Topic:
    """Attributes of one topic.

    Attributes:
        noun: Its name, last part of the bus key.
        rate_hz: Nominal rate, 0 where it comes by event.
        rank: Order at equal stamps in virtual time.
        scope: Per vehicle, per rig or per process.
        delivery: Queue policy.
        latched: The last value reaches late joiners.
        observers_only: Only view, recorder, report and nodes that publish for them may subscribe.
        recorded: Recording policy.
        pace_ns: Nodes that take the topic paced receive the first message of each period of this length of
            the publisher's clock; 0 where none may.
        is_apart: It comes by a session of its own and waits behind nothing.
    """

    noun: str
    rate_hz: float = 0.0
    rank: Rank = Rank.REPORT
    scope: Scope = Scope.VEHICLE
    delivery: Delivery = Delivery.EVERY
    latched: bool = False
    observers_only: bool = False
    recorded: Recorded = Recorded.ALWAYS
    pace_ns: int = 0
    is_apart: bool = False


class Pace:
    """Passes the first message of each period; applied twice it passes the same ones.

    Args:
        period_ns: Length of a period; periods begin at multiples of it.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._period = -1

    def passes(self, publish_ns: int) -> bool:
        """Whether a message that was published then is the first of its period."""
        period = publish_ns // self._period_ns
        if period == self._period:
            return False
        self._period = period
        return True
