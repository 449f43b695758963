"""A CAN adapter as frames with arrival stamps; which adapter, the rig's configuration states."""

import os
import socket
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Self

import can
from can.interfaces.slcan import slcanBus

from drivers.errors import LinkLost, NotFound
from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.messages import SILENCE_CLOSES_S
from drivers.valve_bus.protocol import ARM_ID, COMMAND_ID, FLOAT_AIR_ID, STOP_ID

_VEHICLE_BITS = 0x00F
_STATION_IDS = frozenset((STOP_ID, ARM_ID, FLOAT_AIR_ID, COMMAND_ID))  # sent by the station, obeyed by nodes
_SLICE_S = 0.1  # `frames` looks for a close this often
# each back end of python-can raises its own kind when it cannot open: all mean that there is no bus
_OPEN_ERRORS = (can.CanError, OSError, ValueError, TypeError, ImportError, NotImplementedError)  # no bus


@dataclass(slots=True)
class PortCounters:
    """What passed the port since it was opened."""

    received: int = 0
    sent: int = 0
    own_echoes: int = 0
    """Frames with a station's identifier: multicast and some adapters hand back what was sent."""
    foreign: int = 0
    """Error, remote, extended and FD frames."""
    garbled: int = 0
    """Lines of a serial adapter that are no frame."""


class ValveBusPort:
    """The station's side of the valve bus. One thread may read while others send.

    Args:
        config: Keyword arguments of `can.Bus`: `interface`, `channel`, usually `bitrate`, and whatever else
            the interface takes. `sleep_after_open` of a slcan adapter is 0 by default behind a network
            socket; on a serial port it stays at python-can's 2 s, which adapters that reset on opening want.

    Raises:
        ValueError: `interface` or `channel` is missing.
        NotFound: The adapter cannot be opened.
    """

    def __init__(self, config: Mapping[str, Any]) -> None:
        for key in ("interface", "channel"):
            if key not in config:
                raise ValueError(f"the valve bus needs the key {key!r}")
        self.name = f"{config['interface']} {config['channel']}"
        self.counters = PortCounters()
        self._closing = threading.Event()
        self._reading = threading.Lock()
        self._sending = threading.Lock()
        try:
            self._bus = can.Bus(**_with_defaults(config), ignore_config=True)
        except _OPEN_ERRORS as error:
            raise NotFound(f"the valve bus on {self.name} cannot be opened: {error}") from error
        _make_prompt(self._bus)

    def read(self, timeout_s: float) -> tuple[int, CanFrame] | None:
        """The next frame from a node with the host's monotonic stamp; None if none came in time.

        Raises:
            LinkLost: The adapter is gone, or the port is closed.
        """
        deadline_s = time.monotonic() + timeout_s
        with self._reading:
            while not self._closing.is_set():
                message = self._receive(max(0.0, deadline_s - time.monotonic()))
                stamp_ns = time.monotonic_ns()
                frame = None if message is None else self._accept(message)
                if frame is not None:
                    self.counters.received += 1
                    return stamp_ns, frame
                if time.monotonic() >= deadline_s:
                    return None
        raise LinkLost(f"the valve bus on {self.name} is closed")

    def frames(self) -> Iterator[tuple[int, CanFrame]]:
        """Every frame from a node with its stamp, until the port is closed.

        Raises:
            LinkLost: The adapter is gone.
        """
        while not self._closing.is_set():
            try:
                arrival = self.read(_SLICE_S)
            except LinkLost:
                if self._closing.is_set():
                    return
                raise
            if arrival is not None:
                yield arrival

    def send(self, frame: CanFrame) -> None:
        """Hand a frame to the adapter.

        Raises:
            LinkLost: The adapter is gone, closed, or took nothing for 100 ms.
        """
        message = can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False)
        with self._sending:
            if self._closing.is_set():
                raise LinkLost(f"the valve bus on {self.name} is closed")
            try:
                self._bus.send(message, timeout=SILENCE_CLOSES_S)
            except (can.CanError, OSError) as error:
                raise LinkLost(f"the valve bus on {self.name} does not take frames: {error}") from error
        self.counters.sent += 1

    def close(self) -> None:
        """Release the adapter; a reader in another thread ends first. May be called twice."""
        if self._closing.is_set():
            return
        self._closing.set()
        with self._reading, self._sending:
            _shut_down(self._bus)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _receive(self, timeout_s: float) -> can.Message | None:
        try:
            return self._bus.recv(min(timeout_s, _SLICE_S))
        except (ValueError, IndexError):  # slcan: a line of noise
            self.counters.garbled += 1
            return None
        except (can.CanError, OSError) as error:
            if not isinstance(error.__cause__, UnicodeDecodeError) or not isinstance(self._bus, slcanBus):
                raise LinkLost(f"the valve bus on {self.name} is lost: {error.__cause__ or error}") from error
            self.counters.garbled += 1
            self._bus.flush()  # else its buffer keeps that line and fails at every next one
            return None

    def _accept(self, message: can.Message) -> CanFrame | None:
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id or message.is_fd:
            self.counters.foreign += 1
            return None
        if message.arbitration_id & ~_VEHICLE_BITS in _STATION_IDS:
            self.counters.own_echoes += 1
            return None
        try:
            return CanFrame(message.arbitration_id, bytes(message.data))
        except ValueError:
            self.counters.garbled += 1
            return None


def _with_defaults(config: Mapping[str, Any]) -> dict[str, Any]:
    arguments = dict(config)
    if arguments["interface"] == "slcan":
        arguments.setdefault(
            "timeout", _SLICE_S / 2
        )  # one byte ends the wait; 1 ms would wake 1000 times a second
        if str(arguments["channel"]).startswith("socket://"):
            arguments.setdefault("sleep_after_open", 0.0)
    return arguments


def _make_prompt(bus: can.BusABC) -> None:
    """A slcan line must not wait: neither for an acknowledgement (Nagle) nor for ever on a full buffer."""
    port = getattr(bus, "serialPortOrig", None)
    if port is None:
        return
    port.write_timeout = SILENCE_CLOSES_S
    if str(port.port).startswith("socket://"):
        with socket.socket(fileno=os.dup(port.fileno())) as same_socket:
            same_socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _shut_down(bus: can.BusABC) -> None:
    """On a dead link slcan gives up before it closes its port, and pyserial before it closes its socket."""
    port = getattr(bus, "serialPortOrig", None)
    open_socket = getattr(port, "_socket", None)
    with suppress(can.CanError, OSError):  # that the adapter is dead is no news to somebody who closes it
        bus.shutdown()
    if port is not None:
        port.close()
    if open_socket is not None:
        open_socket.close()
