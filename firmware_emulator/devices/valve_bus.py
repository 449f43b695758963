"""The CAN bus between the station and all valve nodes: one wire, one frame at a time."""

from collections import deque
from collections.abc import Sequence

from drivers.valve_bus.protocol import CanFrame
from firmware_emulator.devices.pending import take_until
from firmware_emulator.devices.valve_node import ValveNode

NS_PER_S = 1_000_000_000
_FRAME_BITS = 47  # of a frame without data, interframe space included (ISO 11898-1)
_STUFFING = 1.1  # bit stuffing adds up to a fifth; a tenth is usual

_SHORTEST_BYTES = 6  # status and pressure, the shortest that nodes send


class ValveBus:
    """Carries frames between the host and the nodes.

    A node's frame reaches the host alone, since nodes have nothing to say to each other.

    Args:
        nodes: All nodes.
        bitrate: Bits per second.
    """

    def __init__(self, nodes: Sequence[ValveNode], bitrate: float) -> None:
        self._nodes = nodes
        self._bit_ns = NS_PER_S / bitrate
        self._free_ns = 0
        self._shortest_ns = self._duration_ns(_SHORTEST_BYTES)
        self._pending: deque[tuple[int, CanFrame]] = deque()

    @property
    def next_output_ns(self) -> int:
        """When the next frame of a node may reach the host."""
        if self._pending:
            return self._pending[0][0]
        return min(node.next_output_ns for node in self._nodes) + self._shortest_ns

    def send(self, stamp_ns: int, frame: CanFrame) -> None:
        """A frame of the host: every node hears it when it is complete."""
        complete_ns = self._transmit(stamp_ns, frame)
        for node in self._nodes:
            node.receive(complete_ns, frame)

    def collect(self, node: ValveNode, now_ns: int) -> None:
        """Put what a node wants to say on the wire."""
        for frame in node.outbox:
            self._pending.append((self._transmit(now_ns, frame), frame))
        node.outbox.clear()

    def take(self, until_ns: int) -> list[tuple[int, CanFrame]]:
        """Frames that reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def _transmit(self, stamp_ns: int, frame: CanFrame) -> int:
        self._free_ns = max(self._free_ns, stamp_ns) + self._duration_ns(len(frame.data))
        return self._free_ns

    def _duration_ns(self, data_bytes: int) -> int:
        return round((_FRAME_BITS + 8 * data_bytes) * _STUFFING * self._bit_ns)
