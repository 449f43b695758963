"""What serves a channel live: made by the name that its device's kind states, fed with what arrives."""

import selectors
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from drivers.laboratory import Address
from firmware_emulator.config import LaboratoryConfig
from firmware_emulator.live.tcp_server import TcpServer


@dataclass(frozen=True, slots=True)
class LiveChannel:
    """A channel that wants to be served.

    Attributes:
        name: Of the channel.
        selector: Owner of all sockets; its keys carry a callable as data, called when the file is ready.
        config: The scenario.
        settings: The section of the device whose channel it is.
        deliver: Sends something into the channel now.
    """

    name: str
    selector: selectors.BaseSelector
    config: LaboratoryConfig
    settings: Any
    deliver: Callable[[Any], None]


class Served(Protocol):
    """A channel that is served."""

    @property
    def address(self) -> Address:
        """Where a client opens it."""
        ...

    @property
    def lost(self) -> int:
        """What was dropped because a client did not read: bytes or messages."""
        ...

    def send(self, data: Any) -> None:  # noqa: ANN401 - of the channel's kind
        """Hand what has arrived to the clients; never waits."""
        ...

    def close(self) -> None:
        """Give every port back; may be called twice."""
        ...


Serve = Callable[[LiveChannel], Served]


class TcpServed:
    """Bytes, to everybody who connects."""

    def __init__(self, channel: LiveChannel) -> None:
        self._server = TcpServer(channel.selector)

    @property
    def address(self) -> Address:
        """A URL that pyserial opens."""
        return self._server.url

    @property
    def lost(self) -> int:
        """Messages that present clients missed."""
        return self._server.dropped_messages

    def send(self, data: bytes) -> None:
        """Send to all."""
        self._server.broadcast(data)

    def close(self) -> None:
        """Close every socket."""
        self._server.close()
