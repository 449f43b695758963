"""Keeps the real edges open: one reader thread per port, which retries with back-off and reports trouble."""

import threading
from collections.abc import Callable, Iterable, Mapping

from drivers.errors import DeviceError
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port

FIRST_RETRY_S = 0.2
LAST_RETRY_S = 5.0
OK, WARNING, ERROR = 0, 1, 2

FromPort = Callable[[Port, int, object], None]
Trouble = Callable[[str, int, str], None]
Crash = Callable[[Exception], None]


class PortThread(threading.Thread):
    """Keeps one port open and reads it.

    Args:
        port: The port, with its address resolved.
        deliver: Called with what arrived, on this thread.
        trouble: Called with (channel, level, sentence) when the device opens, or cannot, or goes away. A
            device that was lost counts as open again only when something arrives.
        crash: Called with what nobody foresaw; the thread then ends.
    """

    def __init__(self, port: Port, deliver: FromPort, trouble: Trouble, crash: Crash) -> None:
        super().__init__(name=f"port {port.channel}", daemon=True)
        self.port = port
        self._deliver = deliver
        self._trouble = trouble
        self._crash = crash
        self._closing = threading.Event()
        self._edge: Edge | None = None
        self._is_well = True
        self._wait_s = FIRST_RETRY_S

    def read_first(self) -> Iterable[tuple[int, object]]:
        """Open the port and read once, before the thread is started, which then goes on with it.

        Returns:
            What arrived, as (stamp_ns, data); nothing where the device cannot be opened, which is reported
            and tried again by the thread.
        """
        try:
            self._edge = self.port.open()
            return tuple(self._edge.read())
        except DeviceError as error:
            self._release()
            self._trouble(self.port.channel, ERROR, f"{self.port.channel}: {error}")
            return ()

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
            except SystemExit as error:  # a bug of an edge, which would end this thread unseen
                self._crash(RuntimeError(f"{self.port.channel}: its edge asks to exit ({error})"))
                return
            except Exception as error:  # a bug: the loop raises it, else the thread would die unseen
                self._crash(error)
                return
            finally:
                self._release()
            self._closing.wait(self._wait_s)
            self._wait_s = min(2 * self._wait_s, LAST_RETRY_S)

    def _read_on(self) -> None:
        edge = self._edge
        if edge is None:
            edge = self._edge = self.port.open()
        is_reported = self._is_well
        if is_reported:
            self._report_open()
        while not self._closing.is_set():
            for stamp_ns, data in edge.read():
                self._deliver(self.port, stamp_ns, data)
                self._wait_s = FIRST_RETRY_S
                if not is_reported:
                    is_reported = self._is_well = True
                    self._report_open()

    def _report_open(self) -> None:
        address = self.port.address
        if isinstance(address, Mapping):
            address = f"{address.get('interface')} {address.get('channel')}"
        self._trouble(self.port.channel, OK, f"{self.port.channel}: open at {address}")

    def write(self, payload: Message) -> None:
        """Send a message out; where the device is gone it is lost, and reported."""
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
