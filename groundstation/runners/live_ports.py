"""Opens the real edges: one reader thread per port, which retries with back-off and says so.

``OPENERS`` maps a translation to the driver that serves it; a new kind of port is one row more.
"""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from typing import cast

from drivers.errors import DeviceError
from drivers.imu_block.port import SerialPort
from drivers.laboratory import CanFrame
from drivers.star_camera.port import StarCamera
from drivers.valve_bus.port import ValveBusPort as ValveBusDriver
from groundstation.messages.base import Message
from groundstation.runtime.ports import (
    FixStreamPort,
    ImuPort,
    OverheadCameraPort,
    PortTranslation,
    ReferencePort,
    StarCameraPort,
    ValveBusPort,
)

READ_TIMEOUT_S = 0.2
FIRST_RETRY_S = 0.2
LAST_RETRY_S = 5.0
OK, WARNING, ERROR = 0, 1, 2

FromPort = Callable[[PortTranslation, int, object], None]
Trouble = Callable[[str, int, str], None]
Crash = Callable[[Exception], None]


class Edge(ABC):
    """An open device."""

    @abstractmethod
    def read(self) -> Iterable[tuple[int, object]]:
        """What arrived, as (stamp_ns, data); empty after a while of silence. Raises DeviceError."""

    def write(self, data: bytes | CanFrame) -> None:
        """Send something out. Raises DeviceError."""
        raise TypeError(f"{type(self).__name__} is read-only, cannot send {data!r}")

    def wake(self) -> None:
        """Make a waiting ``read`` in another thread return; by itself it does within ``READ_TIMEOUT_S``."""
        return

    @abstractmethod
    def close(self) -> None:
        """Release the device; may be called twice."""


class _ByteEdge(Edge):
    def __init__(self, url: str, baud: int) -> None:
        self._port = SerialPort(url, baud)

    def read(self) -> Iterable[tuple[int, object]]:
        stamp_ns, data = self._port.read_chunk(READ_TIMEOUT_S)
        return ((stamp_ns, data),) if data else ()

    def write(self, data: bytes | CanFrame) -> None:
        assert isinstance(data, bytes)
        self._port.write(data)

    def wake(self) -> None:
        self._port.wake()

    def close(self) -> None:
        self._port.close()


class _CameraEdge(Edge):
    def __init__(self, source: str, timeout_s: float, *, is_colour: bool = False) -> None:
        address = int(source) if source.isdigit() else source  # a device index
        self._camera = StarCamera.open(address, silence_s=timeout_s, is_colour=is_colour)

    def read(self) -> Iterable[tuple[int, object]]:
        frame = self._camera.read(READ_TIMEOUT_S)
        return () if frame is None else ((frame.stamp_ns, frame),)

    def close(self) -> None:
        self._camera.close()


class _CanEdge(Edge):
    def __init__(self, config: Mapping[str, object]) -> None:
        self._bus = ValveBusDriver(config)

    def read(self) -> Iterable[tuple[int, object]]:
        found = self._bus.read(READ_TIMEOUT_S)
        return () if found is None else (found,)

    def write(self, data: bytes | CanFrame) -> None:
        assert isinstance(data, CanFrame)
        self._bus.send(data)

    def close(self) -> None:
        self._bus.close()


STREAM_BAUD = 115200  # of pose streams; sockets ignore it

OPENERS: dict[type[PortTranslation], Callable[[PortTranslation], Edge]] = {
    ImuPort: lambda port: _ByteEdge(str(port.address), cast("ImuPort", port).baud),
    FixStreamPort: lambda port: _ByteEdge(str(port.address), STREAM_BAUD),
    ReferencePort: lambda port: _ByteEdge(str(port.address), STREAM_BAUD),
    StarCameraPort: lambda port: _CameraEdge(str(port.address), cast("StarCameraPort", port).timeout_s),
    OverheadCameraPort: lambda port: _CameraEdge(
        str(port.address), cast("OverheadCameraPort", port).timeout_s, is_colour=True
    ),
    ValveBusPort: lambda port: _CanEdge(cast("Mapping[str, object]", port.address)),
}


class PortThread(threading.Thread):
    """Keeps one port open and reads it.

    Args:
        port: The translation, with its address resolved.
        deliver: Called with what arrived, on this thread.
        trouble: Called with (channel, level, sentence) when the device opens, or cannot, or goes away. A
            device that was lost counts as open again only when something arrives.
        crash: Called with what nobody foresaw; the thread then ends.
    """

    def __init__(self, port: PortTranslation, deliver: FromPort, trouble: Trouble, crash: Crash) -> None:
        super().__init__(name=f"port {port.channel}", daemon=True)
        self.port = port
        self._deliver = deliver
        self._trouble = trouble
        self._crash = crash
        self._closing = threading.Event()
        self._edge: Edge | None = None
        self._is_well = True
        self._wait_s = FIRST_RETRY_S

    def run(self) -> None:
        """Read until closed."""
        while not self._closing.is_set():
            try:
                self._read_on()
            except DeviceError as error:
                self._is_well = False
                if not self._closing.is_set():
                    sentence = f"{self.port.channel}: {error}; next try in {self._wait_s:.1f} s"
                    self._trouble(self.port.channel, ERROR, sentence)
            except Exception as error:  # a bug: the loop raises it, else the thread would die unseen
                self._crash(error)
                return
            finally:
                self._release()
            self._closing.wait(self._wait_s)
            self._wait_s = min(2 * self._wait_s, LAST_RETRY_S)

    def _read_on(self) -> None:
        edge = self._edge = OPENERS[type(self.port)](self.port)
        is_said = self._is_well
        if is_said:
            self._say_open()
        while not self._closing.is_set():
            for stamp_ns, data in edge.read():
                self._deliver(self.port, stamp_ns, data)
                self._wait_s = FIRST_RETRY_S
                if not is_said:
                    is_said = self._is_well = True
                    self._say_open()

    def _say_open(self) -> None:
        address = self.port.address
        if isinstance(address, Mapping):
            address = f"{address.get('interface')} {address.get('channel')}"
        self._trouble(self.port.channel, OK, f"{self.port.channel}: open at {address}")

    def write(self, payload: Message) -> None:
        """Send a message out; where the device is gone it is lost and said so."""
        edge = self._edge
        if edge is None:
            return
        try:
            edge.write(self.port.to_device(payload))
        except DeviceError as error:
            self._trouble(self.port.channel, WARNING, f"{self.port.channel}: {error}")

    def ask_to_end(self) -> None:
        """Let the thread end soon."""
        self._closing.set()
        edge = self._edge
        if edge is not None:
            edge.wake()

    def close(self) -> None:
        """End the thread and release the device."""
        self.ask_to_end()
        if self.is_alive():
            self.join(timeout=1.0)
        self._release()

    def _release(self) -> None:
        edge, self._edge = self._edge, None
        if edge is not None:
            edge.close()
