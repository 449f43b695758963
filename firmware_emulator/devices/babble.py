"""A CAN node that babbles: frames nobody asked for, as fast as the wire takes them."""

from drivers.valve_bus.protocol import CanFrame
from firmware_emulator.failures import Failures
from firmware_emulator.plant.thrusters import FAR_FUTURE_NS, NS_PER_S

FOREIGN_ID = 0x700
"""Of no message of the valve bus, and of a lower priority than all; the vehicle's index is added."""


class Babble:
    """What a node sends too much.

    Args:
        index: Vehicle's index on the bus.
        failures: `flooded_bus`.
        start_ns: Laboratory time that failures count from.

    Attributes:
        next_ns: When it next sends.
    """

    def __init__(self, index: int, failures: Failures, start_ns: int) -> None:
        self._index, self._failures, self._start_ns = index, failures, start_ns
        self._count = 0
        self.next_ns = FAR_FUTURE_NS

    def begin(self, stamp_ns: int) -> None:
        """Begin at `stamp_ns`, which is a moment at which the node acts anyway, if it does not babble yet."""
        self.next_ns = min(self.next_ns, stamp_ns)

    def take(self, now_ns: int, last_status: CanFrame | None) -> CanFrame | None:
        """The frame that is due now, or None; afterwards `next_ns` lies later."""
        if self.next_ns > now_ns:
            return None
        failure = self._failures.active("flooded_bus", now_ns - self._start_ns)
        if failure is None:
            self.next_ns = FAR_FUTURE_NS
            return None
        self.next_ns = now_ns + max(1, round(NS_PER_S / failure.parameters["rate_hz"]))
        self._count += 1
        if failure.parameters["own_ids"] and last_status is not None:
            return last_status
        return CanFrame(FOREIGN_ID + self._index, self._count.to_bytes(8, "little"))
