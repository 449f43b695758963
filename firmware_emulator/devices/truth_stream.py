"""The truth as a motion-capture system would send it: stamped exactly, on the reference stream's wire.

`docs/interfaces/reference_stream.md` gives the bytes.
"""

import math
from collections import deque

from drivers.laboratory import ChannelKind
from drivers.reference.protocol import ReferencePose, encode
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.pending import take_until
from firmware_emulator.mock_up_config import VehicleConfig
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import NS_PER_S
from firmware_emulator.scenario import MockUp

_SEQUENCE_MODULUS = 1 << 16
_TRUE_UNCERTAINTY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class TruthStream:
    """Poses and velocities of a vehicle's body origin at a fixed rate.

    Args:
        index: Vehicle's index.
        vehicle: Whose motion.
        rate_hz: Poses per second.
        delay_s: From the moment of a pose to the host.
        start_ns: First pose one period later.
    """

    def __init__(self, index: int, vehicle: Vehicle, rate_hz: float, delay_s: float, start_ns: int) -> None:
        self._index, self._vehicle = index, vehicle
        self._period_ns = round(NS_PER_S / rate_hz)
        self._delay_ns = round(delay_s * NS_PER_S)
        self.next_ns = start_ns + self._period_ns
        self._sequence = 0
        self._pending: deque[tuple[int, bytes]] = deque()

    @property
    def next_output_ns(self) -> int:
        """When the next pose may reach the host."""
        return self._pending[0][0] if self._pending else self.next_ns + self._delay_ns

    def take(self, until_ns: int) -> list[tuple[int, bytes]]:
        """Poses that reached the host up to `until_ns`."""
        return take_until(self._pending, until_ns)

    def run(self, now_ns: int) -> None:
        """Measure the pose that is due."""
        motion = self._vehicle.origin_at(now_ns)
        pose = ReferencePose(
            vehicle=self._index,
            sequence=self._sequence,
            stamp_source_ns=now_ns,
            age_ns=self._delay_ns,
            position_table_m=(motion.x_m, motion.y_m),
            heading_rad=math.remainder(motion.heading_rad, math.tau),
            velocity_table_m_s=(motion.vx_m_s, motion.vy_m_s),
            rate_rad_s=motion.rate_rad_s,
            pose_covariance=_TRUE_UNCERTAINTY,
            is_host_clock=True,
        )
        self._sequence = (self._sequence + 1) % _SEQUENCE_MODULUS
        self._pending.append((now_ns + self._delay_ns, encode(pose)))
        self.next_ns += self._period_ns


def build_truth(mock_up: MockUp, config: VehicleConfig) -> TruthStream | None:
    """The truth about a mock-up, if its table asks for it."""
    if config.reference_rate_hz == 0.0:
        return None
    return TruthStream(
        mock_up.index, mock_up.vehicle, config.reference_rate_hz, config.reference_delay_s, mock_up.start_ns
    )


REFERENCE = DeviceKind(
    name="reference",
    channel=ChannelKind.BYTES,
    per_vehicle=build_truth,
    served_by="firmware_emulator.live.served:TcpServed",
)
