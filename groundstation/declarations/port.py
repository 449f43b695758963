"""THE TABLE of ports: the edges of the graph, where bytes, pictures and CAN frames become messages.

A ``PortTranslation`` is pure and serves both runners; what opens a real device is ``live_ports``.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

from drivers.laboratory import CameraFrame, CanFrame
from drivers.star_camera.exposure import ExposureDelay
from groundstation.bus.topics import Delivery
from groundstation.messages import definitions as m
from groundstation.messages.base import Message
from groundstation.runtime.rig import Rig


@dataclass(frozen=True)
class PortTranslation(ABC):
    """One edge.

    Attributes:
        channel: Name of the channel, as laboratories announce it: ``alpha/imu``, ``valve_bus``.
        vehicle: Whose it is, empty for what all vehicles share.
        address: Where the rig says it is opened.
        process: Name of the process that owns the edge.
        reads: Class of the payloads that come in here.
    """

    reads: ClassVar[type[Message]]

    channel: str
    vehicle: str
    address: object
    process: str

    @property
    def delivery(self) -> Delivery:
        """Whether a slow process sees every item or only the newest."""
        return Delivery.EVERY

    @abstractmethod
    def to_message(self, stamp_ns: int, data: object) -> Message:
        """What arrived at ``stamp_ns``, as a message."""

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        """Payload classes and vehicles whose messages leave through this edge."""
        return ()

    def to_device(self, payload: Message) -> bytes | CanFrame:
        """A message, as it leaves."""
        raise TypeError(f"{self.channel} takes no {type(payload).__name__}")


@dataclass(frozen=True)
class ImuPort(PortTranslation):
    """Serial port of an IMU block."""

    reads = m.ImuBytes

    baud: int

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return m.ImuBytes(stamp_ns, self.vehicle, data)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return ((m.ImuOrder, self.vehicle),)

    def to_device(self, payload: Message) -> bytes | CanFrame:
        assert isinstance(payload, m.ImuOrder)
        return payload.data


@dataclass(frozen=True)
class CameraPort(PortTranslation):
    """A camera: the stamp of a frame is the middle of its exposure, and only the newest frame counts."""

    delay: ExposureDelay
    timeout_s: float

    @property
    def delivery(self) -> Delivery:
        return Delivery.NEWEST


@dataclass(frozen=True)
class StarCameraPort(CameraPort):
    """A star camera: grey frames."""

    reads = m.StarImage

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, CameraFrame)
        height, width = data.image.shape
        exposure_ns = self.delay.middle_ns(stamp_ns)
        return m.StarImage(exposure_ns, self.vehicle, height, width, "mono8", 0, width, data.image.tobytes())


@dataclass(frozen=True)
class OverheadCameraPort(CameraPort):
    """The camera over the table: colour frames, of no vehicle."""

    reads = m.OverheadImage

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, CameraFrame)
        height, width, _ = data.image.shape
        exposure_ns = self.delay.middle_ns(stamp_ns)
        return m.OverheadImage(exposure_ns, "", height, width, "bgr8", 0, 3 * width, data.image.tobytes())


@dataclass(frozen=True)
class FixStreamPort(PortTranslation):
    """An external pose stream whose poses serve as fixes."""

    reads = m.FixBytes

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return m.FixBytes(stamp_ns, self.vehicle, data)


@dataclass(frozen=True)
class ReferencePort(PortTranslation):
    """Truth of the emulator, or motion capture."""

    reads = m.ReferenceBytes

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, bytes)
        return m.ReferenceBytes(stamp_ns, self.vehicle, data)


@dataclass(frozen=True)
class ValveBusPort(PortTranslation):
    """The CAN bus all valve nodes share."""

    reads = m.CanIn

    vehicles: tuple[str, ...]

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, CanFrame)
        return m.CanIn(stamp_ns, "", data.arbitration_id, data.data)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return tuple((m.CanOut, vehicle) for vehicle in self.vehicles)

    def to_device(self, payload: Message) -> bytes | CanFrame:
        assert isinstance(payload, m.CanOut)
        return CanFrame(payload.arbitration_id, payload.data)


def ports_of(rig: Rig) -> list[PortTranslation]:
    """Every edge that the rig names."""
    ports: list[PortTranslation] = [
        ValveBusPort("valve_bus", "", rig.valve_bus, "commands", tuple(rig.vehicles))
    ]
    overhead = rig.overhead_camera
    if overhead is not None:
        delay = ExposureDelay(overhead.delay_s, overhead.delay_sigma_s)
        ports.append(
            OverheadCameraPort("overhead_camera", "", overhead.address, "overhead", delay, overhead.timeout_s)
        )
    for name, vehicle in rig.vehicles.items():
        mock_up = rig.mock_up_of(name)
        ports.append(ImuPort(f"{name}/imu", name, vehicle.imu, f"{name}_flight", mock_up.imu.baud))
        if vehicle.star_camera is not None and mock_up.star_camera is not None:
            camera = mock_up.star_camera
            ports.append(
                StarCameraPort(
                    f"{name}/star_camera",
                    name,
                    vehicle.star_camera,
                    f"{name}_sky",
                    ExposureDelay(camera.delay_s, camera.delay_sigma_s),
                    camera.timeout_s,
                )
            )
        if vehicle.fixes is not None:
            ports.append(FixStreamPort(f"{name}/fixes", name, vehicle.fixes, f"{name}_flight"))
        if vehicle.reference is not None:
            ports.append(ReferencePort(f"{name}/reference", name, vehicle.reference, "station"))
    return ports
