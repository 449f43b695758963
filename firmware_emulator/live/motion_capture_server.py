"""The motion-capture system live: a NatNet server on loopback.

Each client that connects is given a data port of its own, so that several may listen; the newest few are
served, since NatNet has no way of leaving.
"""

import selectors
import socket
import time
from collections import deque
from contextlib import suppress

from drivers.laboratory import Address
from drivers.motion_capture.pose import MotionCapturePose
from firmware_emulator.live.natnet import (
    MessageId,
    encode_frame,
    encode_model,
    encode_server_info,
    parse_request,
)
from firmware_emulator.live.served import LiveChannel
from firmware_emulator.live.tcp_server import LOOPBACK

MAX_CLIENTS = 4
NS_PER_S = 1_000_000_000
_DATAGRAM_BYTES = 65_535


class NatNetServed:
    """Poses to every client, a datagram per frame."""

    def __init__(self, channel: LiveChannel) -> None:
        self._names = [channel.settings.body_name(vehicle.name) for vehicle in channel.config.vehicles]
        self._delay_ns = round(channel.settings.delay_s * NS_PER_S)
        self._numbers = list(range(1, len(self._names) + 1))
        self._frame: list[MotionCapturePose] = []
        self._data_ports: deque[int] = deque(maxlen=MAX_CLIENTS)
        self._lost = 0
        self._selector = channel.selector
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((LOOPBACK, 0))
        self._socket.setblocking(False)
        self._selector.register(self._socket, selectors.EVENT_READ, self._answer)

    @property
    def address(self) -> Address:
        """What `drivers.motion_capture.port.MotionCapturePort` takes."""
        port = str(self._socket.getsockname()[1])
        return {"system": "optitrack", "hostname": LOOPBACK, "interface_ip": LOOPBACK, "port_command": port}

    @property
    def lost(self) -> int:
        """Datagrams that the host did not take."""
        return self._lost

    def send(self, data: MotionCapturePose) -> None:
        """Collect the bodies of a frame, which arrive together, and send them when they are complete."""
        self._frame.append(data)
        if len(self._frame) < len(self._names):
            return
        frame, self._frame = self._frame, []
        now_ns = time.monotonic_ns()
        datagram = encode_frame(frame, self._numbers, now_ns - self._delay_ns, now_ns)
        for port in self._data_ports:
            self._send(datagram, (LOOPBACK, port))

    def close(self) -> None:
        """Give the socket back; may be called twice."""
        if self._socket.fileno() >= 0:
            self._selector.unregister(self._socket)
            self._socket.close()

    def _answer(self) -> None:
        with suppress(BlockingIOError, ConnectionError):  # a client that left bounces what was sent to it
            datagram, client = self._socket.recvfrom(_DATAGRAM_BYTES)
            match parse_request(datagram):
                case MessageId.CONNECT:
                    self._data_ports.append(_free_port())
                    self._send(encode_server_info(self._data_ports[-1]), client)
                case MessageId.MODEL_REQUEST:
                    self._send(encode_model(self._names), client)

    def _send(self, datagram: bytes, address: tuple[str, int]) -> None:
        try:
            self._socket.sendto(datagram, address)
        except (BlockingIOError, ConnectionError):
            self._lost += 1


def _free_port() -> int:
    """A port that nobody has now; the client binds it as soon as it knows it."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])
