"""A pseudo-terminal that behaves like a USB serial adapter nobody is obliged to read."""

import fcntl
import os
import struct
import termios
import tty
from contextlib import suppress

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
