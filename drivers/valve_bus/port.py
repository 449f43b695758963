"""A CAN adapter as frames with arrival stamps; which adapter, the rig's configuration states."""

import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import can
from can.typechecking import CanFilter

from drivers.errors import LinkLost
from drivers.valve_bus.adapter import SLICE_S, open_adapter, prompt_lines, shut_down
from drivers.valve_bus.frame import BusArrival, CanFrame
from drivers.valve_bus.messages import SILENCE_CLOSES_S
from drivers.valve_bus.outbox import Outbox
from drivers.valve_bus.protocol import (
    ARM_ID,
    COMMAND_ID,
    FLOAT_AIR_ID,
    HEARTBEAT_ID,
    PRESSURE_ID,
    STATUS_ID,
    STOP_ID,
)

_VEHICLE_BITS = 0x00F
_STATION_IDS = frozenset((STOP_ID, ARM_ID, FLOAT_AIR_ID, COMMAND_ID))  # sent by the station, obeyed by nodes
_DRAIN_S = 0.005  # what comes within is one batch: 200 a second reach the station, whatever the bus does
_RETRY_S = 0.001
_ECHO_NS = 500_000_000
_MOST_WAITING = 4096
_OLDEST_NS = 60_000_000_000  # beyond, somebody has set the clock
_FROM_NODES = (STATUS_ID, PRESSURE_ID, HEARTBEAT_ID)
_FILTERS: list[CanFilter] = [
    {"can_id": base, "can_mask": 0x7FF & ~_VEHICLE_BITS, "extended": False}
    for base in (STOP_ID, *_FROM_NODES)
]


@dataclass(slots=True)
class PortCounters:
    """What passed the port since it was opened."""

    received: int = 0
    sent: int = 0
    own_echoes: int = 0
    """Frames with a station's identifier: multicast and some adapters hand back what was sent."""
    foreign: int = 0
    """Error, remote, extended and FD frames, and identifiers of no message."""
    garbled: int = 0
    """Lines of a serial adapter that are no frame."""
    superseded: int = 0
    """Frames of a node that a newer one of the same identifier replaced before anybody looked."""
    retried: int = 0
    """Frames that the adapter did not take at once."""
    lost: int = 0
    """Frames for the nodes that were never sent."""


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
        self._outbox = Outbox()
        self._retrier: threading.Thread | None = None
        self._stops_sent: dict[CanFrame, int] = {}
        self._waiting: deque[tuple[int, CanFrame]] = deque(maxlen=_MOST_WAITING)
        self._passed = 0
        self._bus = open_adapter(config, self.name)
        self._lines = prompt_lines(self._bus)
        self._rx_packets = _kernel_counter(config)
        self._rx_before = self._read_kernel_counter()
        if "_apply_filters" in vars(type(self._bus)):  # the adapter or the kernel does it
            with suppress(can.CanError, NotImplementedError):  # then all frames come, and are sorted out here
                self._bus.set_filters(_FILTERS)

    def read(self, timeout_s: float) -> tuple[int, CanFrame] | None:
        """The next frame from a node with the host's monotonic stamp; None if none came in time.

        Raises:
            LinkLost: The adapter is gone, or the port is closed.
        """
        deadline_s = time.monotonic() + timeout_s
        with self._reading:
            while not self._closing.is_set():
                if not self._waiting:
                    self._fill(max(0.0, deadline_s - time.monotonic()))
                if self._waiting:
                    self.counters.received += 1
                    return self._waiting.popleft()
                if time.monotonic() >= deadline_s:
                    return None
        raise LinkLost(f"the valve bus on {self.name} is closed")

    def read_newest(self, timeout_s: float) -> list[BusArrival]:
        """What has come in, of each identifier the newest only; empty if nothing came in time.

        Reads until nothing is left or 5 ms have passed, so that a flood costs little and nothing waits long.

        Raises:
            LinkLost: The adapter is gone, or the port is closed.
        """
        newest: dict[int, tuple[int, CanFrame]] = {}
        found = self.read(timeout_s)
        end_s = time.monotonic() + _DRAIN_S
        while found is not None:
            self.counters.superseded += newest.pop(found[1].arbitration_id, None) is not None
            newest[found[1].arbitration_id] = found
            found = self.read(0.0) if time.monotonic() < end_s else None
        if not newest:
            return []
        passed, self._passed = self._passed + self._passed_in_kernel(), 0
        *before, last = newest.values()
        return [BusArrival(*arrival, 1) for arrival in before] + [
            BusArrival(*last, max(1, passed - len(before)))
        ]

    def frames(self) -> Iterator[tuple[int, CanFrame]]:
        """Every frame from a node with its stamp, until the port is closed.

        Raises:
            LinkLost: The adapter is gone.
        """
        while not self._closing.is_set():
            try:
                arrival = self.read(SLICE_S)
            except LinkLost:
                if self._closing.is_set():
                    return
                raise
            if arrival is not None:
                yield arrival

    def send(self, frame: CanFrame) -> None:
        """Hand a frame to the adapter; what it does not take is tried again for 100 ms, stop first.

        Raises:
            LinkLost: The adapter is gone, closed, or took nothing for 100 ms.
        """
        with self._sending:
            if self._closing.is_set():
                raise LinkLost(f"the valve bus on {self.name} is closed")
            if frame.arbitration_id & ~_VEHICLE_BITS == STOP_ID:
                self._stops_sent[frame] = time.monotonic_ns()
            if not self._outbox and self._try(frame):
                return
            now_ns = time.monotonic_ns()
            self._outbox.put(now_ns, frame)
            self.counters.retried += 1
            self.counters.lost = self._outbox.lost
            if self._outbox.is_stuck(now_ns):
                seconds = SILENCE_CLOSES_S
                raise LinkLost(f"the valve bus on {self.name} has taken no frame for {seconds} s")
            if self._retrier is None:
                self._retrier = threading.Thread(target=self._retry, name="valve bus retry", daemon=True)
                self._retrier.start()

    def _try(self, frame: CanFrame) -> bool:
        message = can.Message(arbitration_id=frame.arbitration_id, data=frame.data, is_extended_id=False)
        try:
            self._bus.send(message, timeout=0.0)
        except can.CanError:  # its queue is full, for one of as many reasons as there are back ends
            self._outbox.refused(time.monotonic_ns())
            return False
        except (OSError, ValueError) as error:
            raise LinkLost(f"the valve bus on {self.name} does not take frames: {error}") from error
        self._outbox.sent(frame)
        self.counters.sent += 1
        return True

    def _retry(self) -> None:
        """Send what waits; the thread ends when nothing does."""
        while not self._closing.wait(_RETRY_S):
            with self._sending, suppress(LinkLost):  # that is reported to who sends next
                frame = self._outbox.first(time.monotonic_ns())
                while frame is not None and self._try(frame):
                    frame = self._outbox.first(time.monotonic_ns())
                self.counters.lost = self._outbox.lost
                if not self._outbox:
                    self._retrier = None
                    return

    def close(self) -> None:
        """Release the adapter; a reader in another thread ends first. May be called twice."""
        if self._closing.is_set():
            return
        self._closing.set()
        retrier = self._retrier
        if retrier is not None:
            retrier.join(timeout=1.0)
        with self._reading, self._sending:
            shut_down(self._bus)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _fill(self, timeout_s: float) -> None:
        """Let what comes in wait in order, what concerns nobody here left out."""
        timeout_s = min(timeout_s, SLICE_S)
        try:
            if self._lines is None:
                message = self._bus.recv(timeout_s)
                frames = [] if message is None else [self._accept(message)]
            else:
                frames = list(self._lines.read(timeout_s))
                self.counters.garbled = self._lines.garbled
                message = None
        except (can.CanError, OSError, ValueError) as error:
            raise LinkLost(f"the valve bus on {self.name} is lost: {error.__cause__ or error}") from error
        stamp_ns = time.monotonic_ns()
        if message is not None and self._rx_packets is not None:  # socketcan: the kernel stamped it
            age_ns = round((time.clock_gettime(time.CLOCK_REALTIME) - message.timestamp) * 1e9)
            stamp_ns -= age_ns if 0 < age_ns < _OLDEST_NS else 0
        self._passed += len(frames)
        for frame in frames:
            if frame is not None and self._concerns_us(frame, stamp_ns):
                self._waiting.append((stamp_ns, frame))

    def _accept(self, message: can.Message) -> CanFrame | None:
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id or message.is_fd:
            self.counters.foreign += 1
            return None
        try:
            return CanFrame(message.arbitration_id, bytes(message.data))
        except ValueError:
            self.counters.garbled += 1
            return None

    def _concerns_us(self, frame: CanFrame, now_ns: int) -> bool:
        """Whether it is a node's, or a stop that is not ours come back."""
        base_id = frame.arbitration_id & ~_VEHICLE_BITS
        is_echo = base_id in _STATION_IDS and base_id != STOP_ID
        if base_id == STOP_ID:
            is_echo = now_ns - self._stops_sent.get(frame, -_ECHO_NS) < _ECHO_NS
        self.counters.own_echoes += is_echo
        is_foreign = not is_echo and base_id not in (STOP_ID, *_FROM_NODES)
        self.counters.foreign += is_foreign
        return not (is_echo or is_foreign)

    def _passed_in_kernel(self) -> int:
        """Frames that the kernel counted and its filter kept from us, since the last call."""
        count = self._read_kernel_counter()
        if count is None or self._rx_before is None:
            return 0
        kept, self._rx_before = count - self._rx_before - self._passed, count
        return max(0, kept)

    def _read_kernel_counter(self) -> int | None:
        if self._rx_packets is None:
            return None
        try:
            return int(self._rx_packets.read_text(encoding="ascii"))
        except (OSError, ValueError):
            return None


def _kernel_counter(config: Mapping[str, Any]) -> Path | None:
    if config["interface"] != "socketcan":
        return None
    return Path("/sys/class/net") / str(config["channel"]) / "statistics" / "rx_packets"
