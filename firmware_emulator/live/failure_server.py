"""The laboratory's own channel live: JSON lines over TCP (`drivers.laboratory.failure_lines`)."""

from drivers.laboratory import (
    Address,
    FailureEvent,
    FailureRefused,
    encode_event,
    parse_order,
)
from drivers.laboratory.failure_lines import MAX_LINE_BYTES
from firmware_emulator.live.served import LiveChannel
from firmware_emulator.live.tcp_server import Client, TcpServer


class FailureServed:
    """Events to every client, those of active failures to a new one; orders from each."""

    def __init__(self, channel: LiveChannel) -> None:
        self._deliver = channel.deliver
        self._active: list[FailureEvent] = []
        self._begun: dict[Client, bytes] = {}  # the line that a client has not finished yet
        self._server = TcpServer(channel.selector, self._receive, self._forget, self._greet)

    @property
    def address(self) -> Address:
        """A URL that pyserial opens."""
        return self._server.url

    @property
    def lost(self) -> int:
        """Messages that present clients missed."""
        return self._server.dropped_messages

    def send(self, data: FailureEvent | FailureRefused) -> None:
        """Send an event to every client."""
        if isinstance(data, FailureEvent):
            self._remember(data)
        self._server.broadcast(encode_event(data))

    def close(self) -> None:
        """Close every socket."""
        self._server.close()

    def _remember(self, event: FailureEvent) -> None:
        if event.is_active:
            self._active.append(event)
            return
        for begun in self._active:
            if (begun.kind, begun.vehicle, begun.parameters) == (event.kind, event.vehicle, event.parameters):
                self._active.remove(begun)
                return

    def _greet(self, client: Client) -> None:
        for event in self._active:
            self._server.send(client, encode_event(event))

    def _receive(self, client: Client, data: bytes) -> None:
        *lines, rest = (self._begun.pop(client, b"") + data).split(b"\n")
        is_too_long = len(rest) > MAX_LINE_BYTES
        self._begun[client] = b"" if is_too_long else rest
        if is_too_long:
            self._refuse(client, f"a line is longer than {MAX_LINE_BYTES} bytes")
        for line in lines:
            if line.strip():
                self._obey(client, line)

    def _obey(self, client: Client, line: bytes) -> None:
        try:
            order = parse_order(line)
        except ValueError as error:
            self._refuse(client, str(error))
            return
        self._deliver(order)

    def _refuse(self, client: Client, reason: str) -> None:
        self._server.send(client, encode_event(FailureRefused(reason)))

    def _forget(self, client: Client) -> None:
        self._begun.pop(client, None)
