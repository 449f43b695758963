"""A socket whose whole answer has a deadline, not only each of its bytes.

A timeout of a socket is one of silence: a sender that trickles byte by byte never meets it.
"""

import io
import socket
import time


class TimedSocket:
    """What ``http.client`` needs of a socket; reads raise TimeoutError once the deadline has passed.

    Args:
        connected: The socket, which its owner closes.
        deadline_s: Monotonic clock; may be changed between reads.
    """

    def __init__(self, connected: socket.socket, deadline_s: float) -> None:
        self._socket = connected
        self.deadline_s = deadline_s

    def sendall(self, data: bytes) -> None:
        """Send everything, in time."""
        self._socket.settimeout(self._left_s())
        self._socket.sendall(data)

    def makefile(self, _mode: str) -> io.BufferedReader:
        """A buffered reader of the socket."""
        return io.BufferedReader(_TimedReader(self))

    def receive_into(self, buffer: memoryview) -> int:
        """As ``socket.recv_into``."""
        self._socket.settimeout(self._left_s())
        return self._socket.recv_into(buffer)

    def close(self) -> None:
        """Nothing: ``http.client`` lets go of a socket while its answer is still being read."""

    def _left_s(self) -> float:
        left_s = self.deadline_s - time.monotonic()
        if left_s <= 0.0:
            raise TimeoutError("timed out")
        return left_s


class _TimedReader(io.RawIOBase):
    def __init__(self, timed: TimedSocket) -> None:
        self._timed = timed

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: memoryview) -> int:  # type: ignore[override] # what BufferedReader passes
        return self._timed.receive_into(buffer)
