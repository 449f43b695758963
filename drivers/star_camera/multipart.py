"""An endless multipart HTTP response cut into its parts, pure.

Cameras and the emulator send `multipart/x-mixed-replace`: a boundary line, a few header lines, an empty
line, the body, again and again. A body ends where its picture ends (``picture_end.py``), else after its
Content-Length, in any case where the next part begins: a wrong length costs one picture at most.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from email.message import Message

from drivers.star_camera.picture_end import PictureEnd

_MAX_HEADER_BYTES = 8192
_MAX_BODY_BYTES = 32 * 1024 * 1024  # no star camera sends more; a body without end must not eat the memory
_MAX_BOUNDARY_BYTES = 200  # RFC 2046 allows 70
_HEAD_END = re.compile(rb"\r?\n\r?\n")  # some senders end lines with LF alone


@dataclass(frozen=True, slots=True)
class Part:
    """One part: header names in lower case, and its body."""

    headers: dict[str, str]
    body: bytes


def boundary_of(content_type: str) -> bytes | None:
    """The boundary of a Content-Type header, with its leading dashes; None if it names none."""
    message = Message()
    message["Content-Type"] = content_type
    boundary = message.get_boundary() if message.get_content_maintype() == "multipart" else None
    if not boundary:
        return None
    return b"--" + boundary.removeprefix("--").encode("latin-1", "replace")


class PartParser:
    """Cuts parts out of a byte stream that may start or break anywhere; never raises on garbage.

    Args:
        boundary: With its leading dashes; None where the sender does not state it: then the first line that
            begins with two dashes is it.
    """

    def __init__(self, boundary: bytes | None) -> None:
        self.bytes_skipped = 0
        self._boundary = boundary
        self._buffer = bytearray()
        self._headers: dict[str, str] | None = None
        self._end = PictureEnd({})
        self._searched = 0

    def feed(self, chunk: bytes) -> Iterator[Part]:
        """Yield every part that the stream so far completes."""
        self._buffer += chunk
        if self._boundary is None and not self._learn_boundary():
            return
        while (self._headers is not None or self._take_headers()) and (body := self._take_body()) is not None:
            headers, self._headers = self._headers or {}, None
            yield Part(headers, body)

    def finish(self) -> Iterator[Part]:
        """Yield what is left when the stream has ended: a last part whose end nothing marked."""
        if self._headers is not None and self._buffer:
            headers, self._headers = self._headers, None
            yield Part(headers, self._cut(len(self._buffer)))

    def _learn_boundary(self) -> bool:
        while (end := self._buffer.find(b"\n")) >= 0:
            line = bytes(self._buffer[:end]).strip()
            if line.startswith(b"--") and 2 < len(line) <= _MAX_BOUNDARY_BYTES:
                self._boundary = line
                return True
            self._skip(end + 1)
        if len(self._buffer) > _MAX_HEADER_BYTES:
            self._skip(len(self._buffer))
        return False

    def _take_headers(self) -> bool:
        assert self._boundary is not None
        start = self._buffer.find(self._boundary)
        if start < 0:
            self._skip(max(0, len(self._buffer) - len(self._boundary)))
            return False
        self._skip(start)
        head_end = _HEAD_END.search(self._buffer, len(self._boundary))
        if head_end is None:
            if len(self._buffer) > _MAX_HEADER_BYTES:
                self._skip(len(self._boundary))
            return False
        lines = self._buffer[len(self._boundary) : head_end.start()].decode("latin-1").split("\n")
        pairs = [line.partition(":") for line in lines if ":" in line]
        self._headers = {name.strip().lower(): value.strip() for name, _, value in pairs}
        del self._buffer[: head_end.end()]
        self._end = PictureEnd(self._headers)
        self._searched = 0
        return True

    def _take_body(self) -> bytes | None:
        assert self._boundary is not None
        next_part = self._buffer.find(self._boundary, max(0, self._searched - len(self._boundary)))
        self._searched = len(self._buffer)
        picture, length = self._end.find(self._buffer), self._length()
        if picture is not None and not 0 <= next_part < picture:
            return self._cut(picture)
        if (
            length is not None
            and not self._end.is_marked
            and length <= (next_part if next_part >= 0 else len(self._buffer))
        ):
            return self._cut(length)
        if next_part >= 0:  # a part cut short ends where the next one begins
            return self._cut(next_part).removesuffix(b"--").removesuffix(b"\n").removesuffix(b"\r")
        if len(self._buffer) > _MAX_BODY_BYTES:
            self._headers = None
            self._skip(len(self._buffer) - len(self._boundary))
        return None

    def _length(self) -> int | None:
        text = (self._headers or {}).get("content-length", "")
        return int(text) if text.isdecimal() and len(text) < 10 and int(text) <= _MAX_BODY_BYTES else None

    def _cut(self, count: int) -> bytes:
        with memoryview(self._buffer) as view:
            body = bytes(view[:count])
        del self._buffer[:count]
        return body

    def _skip(self, count: int) -> None:
        self.bytes_skipped += count - sum(self._buffer.count(end, 0, count) for end in (b"\r", b"\n"))
        del self._buffer[:count]
