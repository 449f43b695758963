"""The parts of a multipart stream over HTTP, each step with a deadline."""

import http.client
import socket
import threading
import time
from contextlib import suppress
from ipaddress import ip_address
from urllib.parse import urlsplit

from drivers.errors import NotFound
from drivers.star_camera.multipart import Part, PartParser, boundary_of
from drivers.star_camera.timed_socket import TimedSocket

_READ_BYTES = 1 << 16
_SAYS_NOTHING = ("", "application/octet-stream")
"""Content types of senders that do not state that theirs is a stream of parts."""


class HttpStream:
    """A stream that was asked for and answered.

    Args:
        url: ``http://...``; no proxy, no redirection.
        timeout_s: How long connecting and the answer's head may take, together.

    Attributes:
        is_of_this_host: The sender is on this machine, so its clocks are ours.
        has_ended: The sender has closed the stream.

    Raises:
        NotFound: Nobody serves a multipart stream there.
    """

    def __init__(self, url: str, timeout_s: float) -> None:
        self.has_ended = False
        self._reading = threading.Lock()
        address = urlsplit(url)
        path = (address.path or "/") + (f"?{address.query}" if address.query else "")
        try:
            self._connection = http.client.HTTPConnection(
                address.hostname or "", address.port, timeout=timeout_s
            )
            deadline_s = time.monotonic() + timeout_s
            self._connection.connect()
            self._socket: socket.socket = self._connection.sock
            self.is_of_this_host = ip_address(self._socket.getpeername()[0]).is_loopback
            self._timed = TimedSocket(self._socket, deadline_s)
            self._connection.sock = self._timed
            self._connection.request("GET", path, headers={"Accept": "multipart/x-mixed-replace"})
            self._response = self._connection.getresponse()
        except (OSError, ValueError, http.client.HTTPException) as error:
            if hasattr(self, "_socket"):
                self._socket.close()
            raise NotFound(f"star camera {url} does not answer: {error or type(error).__name__}") from error
        content_type = self._response.headers.get("Content-Type", "")
        kind = content_type.partition(";")[0].strip().lower()
        is_stream = kind.startswith("multipart/") or kind in _SAYS_NOTHING
        if self._response.status != http.client.OK or not is_stream:
            self.close()
            raise NotFound(
                f"star camera {url} serves no picture stream:"
                f" status {self._response.status}, content type {content_type!r}"
            )
        self._parts = PartParser(boundary_of(content_type))

    def read(self, deadline_s: float) -> list[Part]:
        """Wait for bytes and give the parts that they complete, perhaps none.

        Args:
            deadline_s: Monotonic clock.

        Raises:
            TimeoutError: The deadline has passed.
            OSError: The link is broken.
        """
        self._timed.deadline_s = deadline_s
        try:
            with self._reading:
                chunk = self._response.read1(_READ_BYTES)
        except (ValueError, http.client.HTTPException) as error:  # ValueError: closed meanwhile
            raise OSError(str(error) or type(error).__name__) from error
        if not chunk:
            self.has_ended = True
            return list(self._parts.finish())
        return list(self._parts.feed(chunk))

    def close(self) -> None:
        """Shut the socket down, which wakes a reader."""
        with suppress(OSError):  # the server may have been faster
            self._socket.shutdown(socket.SHUT_RDWR)
        with self._reading:
            self._response.close()
            self._socket.close()
