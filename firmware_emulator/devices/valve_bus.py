"""The CAN bus between the station and all valve nodes: one wire, one frame at a time."""

from collections import deque
from collections.abc import Sequence

from drivers.laboratory import ChannelKind
from drivers.valve_bus.frame import MAX_DATA_BYTES, CanFrame
from firmware_emulator.config import LaboratoryConfig
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.pending import take_until
from firmware_emulator.devices.valve_node import ValveNode
from firmware_emulator.scenario import MockUp, Site

NS_PER_S = 1_000_000_000
_FRAME_BITS = 47  # of a frame without data, interframe space included (ISO 11898-1)
_STUFFING = 1.1  # bit stuffing adds up to a fifth; a tenth is usual

_SHORTEST_BYTES = 6  # status and pressure, the shortest that nodes send


class ValveBus:
    """Carries frames between the host and the nodes.

    A node's frame reaches the host alone, since nodes do not talk to each other.

    Args:
        nodes: All nodes.
        bitrate: Bits per second.
    """

    def __init__(self, nodes: Sequence[ValveNode], bitrate: float) -> None:
        self._nodes = nodes
        self._bit_ns = NS_PER_S / bitrate
        self._free_ns = 0
        self._longest_ns = self._duration_ns(MAX_DATA_BYTES)
        self._shortest_ns = self._duration_ns(_SHORTEST_BYTES)
        self._pending: deque[tuple[int, CanFrame]] = deque()
        self._due_ns = [node.next_ns for node in self._nodes]

    @property
    def next_ns(self) -> int:
        """When the next node acts."""
        return min(self._due_ns)

    @property
    def next_output_ns(self) -> int:
        """When the next frame of a node may reach the host."""
        if self._pending:
            return self._pending[0][0]
        return min([node.next_output_ns for node in self._nodes]) + self._shortest_ns

    def receive(self, stamp_ns: int, data: CanFrame) -> None:
        """A frame of the host: every node receives it when it is complete."""
        complete_ns = self._transmit(stamp_ns, data)
        for row, node in enumerate(self._nodes):
            node.receive(complete_ns, data)
            self._due_ns[row] = node.next_ns

    def run(self, now_ns: int) -> None:
        """Let every node act that is due, and put what it sends on the wire."""
        for row, node in enumerate(self._nodes):
            if self._due_ns[row] > now_ns:
                continue
            node.run(now_ns)
            self._due_ns[row] = node.next_ns
            for frame in node.outbox:
                self._pending.append((self._transmit(now_ns, frame), frame))
            node.outbox.clear()
            for frame in node.babbled:
                # One may wait for the frame on the wire; more are never sent, so that nothing queues up.
                if self._free_ns - now_ns < self._longest_ns:
                    self._pending.append((self._transmit(now_ns, frame), frame))
            node.babbled.clear()

    def take(self, until_ns: int) -> list[tuple[int, CanFrame]]:
        """Frames that reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def _transmit(self, stamp_ns: int, frame: CanFrame) -> int:
        self._free_ns = max(self._free_ns, stamp_ns) + self._duration_ns(len(frame.data))
        return self._free_ns

    def _duration_ns(self, data_bytes: int) -> int:
        return round((_FRAME_BITS + 8 * data_bytes) * _STUFFING * self._bit_ns)


def build(site: Site, config: LaboratoryConfig) -> ValveBus:
    """The bus of all mock-ups, with their nodes."""
    return ValveBus([_build_node(mock_up) for mock_up in site.mock_ups], config.bus_bitrate)


def _build_node(mock_up: MockUp) -> ValveNode:
    return ValveNode(
        mock_up.index,
        mock_up.vehicle,
        mock_up.config.valves.minimum_on_ms,
        mock_up.config.float_delay_s,
        mock_up.failures,
        mock_up.random("node"),
        mock_up.start_ns,
    )


VALVE_BUS = DeviceKind(
    name="valve_bus",
    channel=ChannelKind.CAN,
    per_laboratory=build,
    accepts=CanFrame,
    served_by="firmware_emulator.live.slcan_server:SlcanServed",
)
