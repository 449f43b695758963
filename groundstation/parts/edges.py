"""Open devices that several parts have in common: a line of bytes, a camera."""

from collections.abc import Iterable
from dataclasses import dataclass

from drivers.laboratory import CameraFrame
from groundstation.declarations.camera_image import CameraImage
from groundstation.declarations.message import Message
from groundstation.declarations.port import READ_TIMEOUT_S, Edge, Port
from groundstation.declarations.topic import Delivery

STREAM_BAUD = 115200
"""For streams that a socket usually carries; sockets ignore it."""


class ByteEdge(Edge):
    """A serial port or socket.

    Args:
        url: Device path or pyserial URL.
        baud: Bit rate; sockets ignore it.

    Raises:
        DeviceError: It cannot be opened.
    """

    def __init__(self, url: str, baud: int) -> None:
        from drivers.imu_block.port import SerialPort

        self.port = SerialPort(url, baud)

    def read(self) -> Iterable[tuple[int, object]]:
        stamp_ns, data = self.port.read_chunk(READ_TIMEOUT_S)
        return ((stamp_ns, data),) if data else ()

    def write(self, data: object) -> None:
        assert isinstance(data, bytes)
        self.port.write(data)

    def wake(self) -> None:
        self.port.wake()

    def close(self) -> None:
        self.port.close()


class CameraEdge(Edge):
    """A camera; frames that nobody read before the next one came are lost.

    Args:
        source: Device index, path, URL or folder.
        timeout_s: Silence after which the link counts as lost.
        is_colour: Frames are blue-green-red.

    Raises:
        DeviceError: It cannot be opened.
    """

    def __init__(self, source: str, timeout_s: float, *, is_colour: bool = False) -> None:
        from drivers.star_camera.port import StarCamera  # OpenCV loads only where it is used

        address = int(source) if source.isdigit() else source  # a device index
        self._camera = StarCamera.open(address, silence_s=timeout_s, is_colour=is_colour)

    def read(self) -> Iterable[tuple[int, object]]:
        frame = self._camera.read(READ_TIMEOUT_S)
        return () if frame is None else ((frame.stamp_arrival_ns, frame),)

    def close(self) -> None:
        self._camera.close()


@dataclass(frozen=True)
class GreyCameraPort(Port):
    """Grey pictures of a vehicle's camera as they arrive, of the class ``reads``; only the newest counts."""

    carries = "camera"
    delivery = Delivery.NEWEST

    timeout_s: float

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, CameraFrame)
        assert issubclass(self.reads, CameraImage)
        height, width = data.image.shape
        device_ns = data.stamp_device_ns or 0
        return self.reads(
            stamp_ns, self.vehicle, device_ns, height, width, "mono8", width, data.image.tobytes()
        )

    def open(self) -> Edge:
        return CameraEdge(str(self.address), self.timeout_s)
