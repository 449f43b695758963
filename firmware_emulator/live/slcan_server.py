"""The valve bus live: an slcan adapter over TCP that several clients may share, like nodes of one bus."""

from drivers.laboratory import Address
from drivers.valve_bus.protocol import CanFrame
from firmware_emulator.live.served import LiveChannel
from firmware_emulator.live.slcan import SlcanSession, encode_frame
from firmware_emulator.live.tcp_server import Client, TcpServer


class SlcanServed:
    """CAN frames, to every client that has opened the adapter."""

    def __init__(self, channel: LiveChannel) -> None:
        self._deliver, self._bitrate = channel.deliver, channel.config.bus_bitrate
        self._sessions: dict[Client, SlcanSession] = {}
        self._server = TcpServer(channel.selector, self._receive, self._forget)

    @property
    def address(self) -> Address:
        """Keyword arguments for python-can."""
        return {"interface": "slcan", "channel": self._server.url, "bitrate": round(self._bitrate)}

    @property
    def lost(self) -> int:
        """Messages that present clients missed."""
        return self._server.dropped_messages

    def send(self, data: CanFrame) -> None:
        """A frame of a node, to all who listen."""
        self._send(data, without=None)

    def close(self) -> None:
        """Close every socket."""
        self._server.close()

    def _send(self, frame: CanFrame, without: Client | None) -> None:
        line = encode_frame(frame)
        for client in [client for client, session in self._sessions.items() if session.is_open]:
            if client is not without:
                self._server.send(client, line)

    def _receive(self, client: Client, data: bytes) -> None:
        session = self._sessions.setdefault(client, SlcanSession())
        frames, answers = session.feed(data)
        for frame in frames:
            self._deliver(frame)
            self._send(frame, without=client)
        self._server.send(client, answers)

    def _forget(self, client: Client) -> None:
        self._sessions.pop(client, None)
