"""One frame of the valve bus, whatever adapter carried it."""

from dataclasses import dataclass
from typing import NamedTuple

from drivers.quick_record import quickly_made

MAX_STANDARD_ID = 0x7FF  # ISO 11898-1: 11-bit identifier
MAX_DATA_BYTES = 8  # classic CAN


@quickly_made
@dataclass(frozen=True, slots=True)
class CanFrame:
    """A classic CAN data frame with an 11-bit identifier.

    Attributes:
        arbitration_id: 0..0x7FF; the lower, the higher its priority on the bus.
        data: 0 to 8 bytes.
    """

    arbitration_id: int
    data: bytes

    def __post_init__(self) -> None:
        if not 0 <= self.arbitration_id <= MAX_STANDARD_ID:
            raise ValueError(f"CAN identifier {self.arbitration_id:#x} does not fit 11 bits")
        if len(self.data) > MAX_DATA_BYTES:
            raise ValueError(f"a CAN frame carries at most {MAX_DATA_BYTES} bytes, got {len(self.data)}")


class BusArrival(NamedTuple):
    """A frame from the bus.

    Attributes:
        stamp_ns: Host monotonic time of its arrival.
        frame: The newest of its identifier.
        passed: Frames of all kinds that the bus has carried to here since the arrival before, this one too.
    """

    stamp_ns: int
    frame: CanFrame
    passed: int
