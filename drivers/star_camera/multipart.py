"""An endless multipart HTTP response cut into its parts, pure.

Cameras and the emulator send `multipart/x-mixed-replace`: a boundary line, a few header lines, an empty
line, the body, again and again. The body's length comes from Content-Length where the sender gives one, else
from the next boundary.
"""

from collections.abc import Iterator
from dataclasses import dataclass

_MAX_HEADER_BYTES = 8192
_MAX_BODY_BYTES = 64 * 1024 * 1024  # no star camera sends more; a wrong length must not eat the memory


@dataclass(frozen=True, slots=True)
class Part:
    """One part: header names in lower case, and its body."""

    headers: dict[str, str]
    body: bytes


def boundary_of(content_type: str) -> bytes | None:
    """The boundary of a Content-Type header, with its leading dashes; None if it is no multipart."""
    kind, _, parameters = content_type.partition(";")
    if not kind.strip().lower().startswith("multipart/"):
        return None
    for parameter in parameters.split(";"):
        name, _, value = parameter.strip().partition("=")
        if name.lower() == "boundary" and value:
            return b"--" + value.strip('"').removeprefix("--").encode("latin-1")
    return None


class PartParser:
    """Cuts parts out of a byte stream that may start or break anywhere; never raises on garbage."""

    def __init__(self, boundary: bytes) -> None:
        self.bytes_skipped = 0
        self._boundary = boundary
        self._buffer = bytearray()
        self._headers: dict[str, str] | None = None
        self._searched = 0

    def feed(self, chunk: bytes) -> Iterator[Part]:
        """Yield every part that the stream so far completes."""
        self._buffer += chunk
        while (self._headers is not None or self._take_headers()) and (body := self._take_body()) is not None:
            headers, self._headers = self._headers or {}, None
            yield Part(headers, body)

    def _take_headers(self) -> bool:
        start = self._buffer.find(self._boundary)
        if start < 0:
            self._skip(max(0, len(self._buffer) - len(self._boundary)))
            return False
        self._skip(start)
        head_end = self._buffer.find(b"\r\n\r\n")
        if head_end < 0:
            if len(self._buffer) > _MAX_HEADER_BYTES:
                self._skip(len(self._boundary))
            return False
        lines = self._buffer[len(self._boundary) : head_end].decode("latin-1").split("\r\n")
        pairs = [line.partition(":") for line in lines if ":" in line]
        self._headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
        del self._buffer[: head_end + 4]
        self._searched = 0
        return True

    def _take_body(self) -> bytes | None:
        length = (self._headers or {}).get("content-length")
        if length is None:
            return self._take_body_to_boundary()
        if not length.isdecimal() or int(length) > _MAX_BODY_BYTES:
            self._headers = None
            return None
        if len(self._buffer) < int(length):
            return None
        body = bytes(self._buffer[: int(length)])
        cut_short_at = body.find(self._boundary)
        taken = len(body) if cut_short_at < 0 else cut_short_at
        del self._buffer[:taken]  # a part cut short ends where the next one begins
        return body[:taken]

    def _take_body_to_boundary(self) -> bytes | None:
        end = self._buffer.find(self._boundary, max(0, self._searched - len(self._boundary)))
        self._searched = len(self._buffer)
        if end >= 0:
            body = bytes(self._buffer[:end]).removesuffix(b"\r\n")
            del self._buffer[:end]
            return body
        if len(self._buffer) > _MAX_BODY_BYTES:
            self._headers = None
        return None

    def _skip(self, count: int) -> None:
        self.bytes_skipped += len(self._buffer[:count].strip(b"\r\n"))  # line ends belong between parts
        del self._buffer[:count]
