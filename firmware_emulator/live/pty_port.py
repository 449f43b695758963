"""A pseudo-terminal that behaves like a USB serial adapter nobody is obliged to read."""

import fcntl
import os
import selectors
import struct
import termios
import tty
from contextlib import suppress

from drivers.laboratory import Address
from firmware_emulator.live.served import LiveChannel

MAX_UNREAD_BYTES = 3072  # below the line discipline's 4096, behind which bytes pile up that no flush reaches


class PtyPort:
    """Both ends of a pty in raw mode; the other side opens `path`.

    The slave end stays open here, so that clients may come and go without hanging the line up.

    Attributes:
        path: What a client opens.
        dropped_bytes: Bytes for which there was no room because nobody reads.
    """

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        # Raw at once: a line discipline would echo the frames back as commands, and eat bytes.
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self.dropped_bytes = 0

    def fileno(self) -> int:
        """For a selector: readable when the client has written."""
        return self._master

    def write(self, data: bytes) -> None:
        """Hand bytes to the client; what does not fit is lost, as in a chip's full buffer."""
        written = 0
        if self._unread_bytes() + len(data) <= MAX_UNREAD_BYTES:
            with suppress(BlockingIOError):
                written = os.write(self._master, data)
        self.dropped_bytes += len(data) - written

    def read(self) -> bytes:
        """What the client has written; empty if nothing."""
        try:
            return os.read(self._master, 4096)
        except BlockingIOError:
            return b""

    def _unread_bytes(self) -> int:
        answer = fcntl.ioctl(self._slave, termios.FIONREAD, struct.pack("i", 0))
        return int(struct.unpack("i", answer)[0])

    def close(self) -> None:
        """Give the pty back; may be called twice."""
        for descriptor in (self._slave, self._master):
            with suppress(OSError):  # closed before
                os.close(descriptor)
        self._slave = self._master = -1


class PtyServed:
    """Bytes both ways through a pty."""

    def __init__(self, channel: LiveChannel) -> None:
        self._pty, self._selector, self._deliver = PtyPort(), channel.selector, channel.deliver
        self._selector.register(self._pty, selectors.EVENT_READ, self._receive)

    @property
    def address(self) -> Address:
        """A device path."""
        return self._pty.path

    @property
    def lost(self) -> int:
        """Bytes for which there was no room."""
        return self._pty.dropped_bytes

    def send(self, data: bytes) -> None:
        """Hand bytes to the client."""
        self._pty.write(data)

    def close(self) -> None:
        """Give the pty back; may be called twice."""
        if self._pty.fileno() >= 0:
            self._selector.unregister(self._pty)
        self._pty.close()

    def _receive(self) -> None:
        data = self._pty.read()
        if data:
            self._deliver(data)
