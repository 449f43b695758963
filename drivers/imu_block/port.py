"""The serial port of a byte stream: device name, pty path or pyserial URL.

Bytes are read in blocks as they come and stamped right after the read. (pyserial's own ``read`` on
``socket://`` URLs would go byte by byte, because its ``in_waiting`` there is 0 or 1.)
"""

import contextlib
import os
import select
import time
from pathlib import Path
from typing import Self

import serial

from drivers.errors import LinkLost, NotFound, Refused
from drivers.socket_url import check_socket_url

READ_BYTES = 4096
USB_SERIAL = Path("/sys/bus/usb-serial/devices")


class SerialPort:
    """An open byte stream; one owner at a time, also between processes.

    Args:
        url: ``/dev/ttyUSB0``, the path of a pty, ``socket://host:port``, or another pyserial URL.
        baud: bit rate, bit/s; ignored by sockets.

    Raises:
        NotFound: if nothing is there.
        Refused: if it is in use, forbidden, or does not take the bit rate; a socket without a port.
    """

    def __init__(self, url: str, baud: int = 250_000) -> None:
        self.url = url
        self.baud = baud
        self._port = _open(url, baud)
        self._wake_read, self._wake_write = os.pipe()
        try:
            self._fd: int | None = self._port.fileno()
        except OSError:  # loop:// and the like have no descriptor
            self._fd = None
        self.is_low_latency = _ask_for_low_latency(self._port)
        self.latency_timer_s = _latency_timer_s(url)
        """The FTDI latency timer as the kernel reports it, None where there is no such thing."""
        with contextlib.suppress(OSError, serial.SerialException):
            self._port.reset_input_buffer()  # what waited before we came would look like late arrivals

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def read_chunk(self, timeout_s: float) -> tuple[int, bytes]:
        """Wait for bytes and return all that are there.

        Returns:
            (host monotonic stamp in ns taken after the read, bytes); no bytes after the time-out or ``wake``.

        Raises:
            LinkLost: if the device went away.
        """
        if self._fd is None:
            self._port.timeout = timeout_s
            data = self._port.read(max(1, self._port.in_waiting))
            return time.monotonic_ns(), bytes(data)
        try:
            ready, _, _ = select.select([self._fd, self._wake_read], [], [], timeout_s)
            if self._wake_read in ready:
                os.read(self._wake_read, READ_BYTES)
            if self._fd not in ready:
                return time.monotonic_ns(), b""
            data = os.read(self._fd, READ_BYTES)
        except BlockingIOError:
            return time.monotonic_ns(), b""
        except (OSError, ValueError) as error:
            raise LinkLost(f"{self.url} went away: {error}") from error
        stamp_ns = time.monotonic_ns()
        if not data:
            raise LinkLost(f"{self.url} went away: the other end closed the line")
        return stamp_ns, data

    def write(self, data: bytes) -> None:
        """Send all bytes.

        Raises:
            LinkLost: if the device went away or takes no bytes for a second.
        """
        try:
            self._port.write(data)
        except (OSError, serial.SerialException) as error:
            raise LinkLost(f"{self.url} takes no bytes: {error}") from error

    def wake(self) -> None:
        """Make a waiting ``read_chunk`` in another thread return at once."""
        with contextlib.suppress(OSError):
            os.write(self._wake_write, b"w")

    def close(self) -> None:
        """Give the port back; harmless when called twice. The reading thread must have ended."""
        if not self._port.is_open:
            return
        self._port.close()
        os.close(self._wake_read)
        os.close(self._wake_write)


def _latency_timer_s(url: str) -> float | None:
    path = USB_SERIAL / Path(url).resolve().name / "latency_timer"
    try:
        return int(path.read_text(encoding="ascii")) * 1e-3
    except (OSError, ValueError):
        return None


def _open(url: str, baud: int) -> serial.Serial:
    """Open the port, or say in one sentence why not."""
    check_socket_url(url)
    if url.startswith("/") and not Path(url).exists():
        raise NotFound(f"there is no serial port {url}")
    try:
        return serial.serial_for_url(url, baudrate=baud, timeout=0, write_timeout=1.0, exclusive=True)
    except (ValueError, KeyError) as error:  # KeyError: an option of a URL that pyserial does not know
        raise Refused(f"{url} does not open at {baud} Bd: {error}") from error
    except (OSError, serial.SerialException) as error:
        text = str(error)
        if "exclusively lock" in text:
            raise Refused(f"{url} is already in use by another program") from error
        if isinstance(error.__context__, PermissionError) or "Permission denied" in text:
            raise Refused(f"{url} may not be opened: permission denied (group dialout?)") from error
        raise NotFound(f"{url} cannot be opened: {text}") from error


def _ask_for_low_latency(port: serial.Serial) -> bool:
    """Set the driver's low-latency flag (FTDI: 16 ms to 1 ms); ptys and sockets have none."""
    ask = getattr(port, "set_low_latency_mode", None)
    if ask is None:
        return False
    try:
        ask(True)
    except (ValueError, OSError, NotImplementedError):  # a pty, a socket, a system without the knob
        return False
    return True
