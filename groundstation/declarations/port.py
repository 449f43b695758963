"""What a port is: the edge of the graph, where bytes, pictures and CAN frames become messages.

A ``Port`` is pure but for ``open``, which only the live runner calls; the lockstep runner takes what a
laboratory hands over on the port's channel. What arrived becomes a message as it arrived; nodes conclude
from it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.declarations.topic import Delivery

READ_TIMEOUT_S = 0.2
"""How long an edge may wait for something to arrive before it looks up."""


class Edge(ABC):
    """An open device."""

    @abstractmethod
    def read(self) -> Iterable[tuple[int, object]]:
        """What arrived, as (stamp_ns, data); empty after a while of silence.

        Raises:
            DeviceError: The device is gone.
        """

    def write(self, data: object) -> None:
        """Send something out.

        Raises:
            DeviceError: The device is gone.
        """
        raise TypeError(f"{type(self).__name__} is read-only, cannot send {data!r}")

    def wake(self) -> None:
        """Make a waiting ``read`` in another thread return; by itself it does within ``READ_TIMEOUT_S``."""
        return

    @abstractmethod
    def close(self) -> None:
        """Release the device; may be called twice."""


@dataclass(frozen=True)
class Port(ABC):
    """One edge of the graph.

    Attributes:
        channel: Name of the channel, as laboratories announce it: ``alpha/imu``, ``valve_bus``.
        vehicle: Whose it is, empty for what all vehicles share.
        address: Where the rig gives it is opened.
        reads: Class of the payloads that come in here.
        delivery: Whether a slow process sees every item or only the newest.
        carries: What travels here, in the word of a laboratory's channels: ``bytes``, ``camera``, ``can``;
            empty where any may.
        is_optional: A laboratory without that channel is no mistake.
        is_first: What it reads first is delivered before anything else, in real time.
    """

    reads: ClassVar[type[Message]]
    delivery: ClassVar[Delivery] = Delivery.EVERY
    carries: ClassVar[str] = ""
    is_optional: ClassVar[bool] = False
    is_first: ClassVar[bool] = False

    channel: str
    vehicle: str
    address: object

    @abstractmethod
    def to_message(self, stamp_ns: int, data: object) -> Message:
        """What arrived at ``stamp_ns``, as a message."""

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        """Payload classes and vehicles whose messages leave through this edge."""
        return ()

    def to_device(self, payload: Message) -> object:
        """A message, as it leaves."""
        raise TypeError(f"{self.channel} takes no {type(payload).__name__}")

    @abstractmethod
    def open(self) -> Edge:
        """Open the device at ``address``.

        Raises:
            DeviceError: It cannot be opened.
        """


@dataclass(frozen=True, slots=True)
class PortRow:
    """A port as its part declares it; it lives in the process of the node that reads it.

    Attributes:
        node: Name of that node.
        kind: Its class.
        make: The port of a vehicle, or of the rig (vehicle empty) for a node of the rig or ``is_of_rig``;
            None where the rig names none.
        is_of_rig: One port for all vehicles.
    """

    node: str
    kind: type[Port]
    make: Callable[[Rig, str], Port | None]
    is_of_rig: bool = False
