"""Where a picture in a stream ends, by its own format: known before the next one begins.

Many cameras send no length, some a wrong one. Who waits for the next boundary has each picture one frame
period late, and the last one never. A JPEG ends with its marker, a PNG with its last chunk, a raw picture
after its rows; what is damaged ends at the next boundary. Pure.
"""

import re
from collections.abc import Mapping

MONO8 = "application/x-mono8"
BGR8 = "application/x-bgr8"
BYTES_PER_PIXEL = {MONO8: 1, BGR8: 3}
"""Types of raw pictures, whose bytes tell nothing of what they are."""
MAX_SIDE_PX = 16384

JPEG_START = b"\xff\xd8\xff"
PNG_START = b"\x89PNG\r\n\x1a\n"
_LINE_ENDS = b"\r\n"  # some senders put an empty line too many before a picture

# In a scan FF 00 is a byte, FF D0 to FF D7 are restarts, FF FF is filling: other markers end it.
_MARKER_IN_SCAN = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")
_END, _SCAN, _FILL = 0xD9, 0xDA, 0xFF
_AFTER_SCAN = frozenset(
    {0xC4, 0xDA, 0xDB, 0xDC, 0xDD, 0xFE, *range(0xE0, 0xF0)}
)  # further scans, their tables
_BARE = frozenset({0x01, *range(0xD0, 0xD9)})  # markers without a length


def type_in(headers: Mapping[str, str]) -> str:
    """The Content-Type of a part without its parameters, lower case; empty if there is none."""
    return headers.get("content-type", "").partition(";")[0].strip().lower()


def raw_shape(headers: Mapping[str, str]) -> tuple[int, int] | None:
    """Rows and columns that a part declares; None where it declares none that a picture can have."""
    sides = [headers.get(name, "") for name in ("x-height", "x-width")]
    rows, columns = (int(side) if side.isdecimal() and len(side) < 6 else 0 for side in sides)
    return (rows, columns) if 0 < rows <= MAX_SIDE_PX and 0 < columns <= MAX_SIDE_PX else None


class PictureEnd:
    """Looks for the end of one picture in bytes that grow."""

    def __init__(self, headers: Mapping[str, str]) -> None:
        shape, bytes_per_pixel = raw_shape(headers), BYTES_PER_PIXEL.get(type_in(headers))
        self._raw_bytes: int | None = None
        if shape is not None and bytes_per_pixel is not None:
            self._raw_bytes = shape[0] * shape[1] * bytes_per_pixel
        self._is_raw = bytes_per_pixel is not None
        self._at: int | None = None
        self._is_jpeg = self._is_in_scan = False
        self.is_marked = False
        """Whether the picture carries its own end: a length can only confirm it."""

    def find(self, data: bytearray) -> int | None:
        """How many bytes of ``data`` the picture at its beginning takes; None if that is not known yet."""
        if self._is_raw:
            is_whole = self._raw_bytes is not None and len(data) >= self._raw_bytes
            return self._raw_bytes if is_whole else None
        if self._at is None and not self._begin(data):
            return None
        return self._find_jpeg_end(data) if self._is_jpeg else self._find_png_end(data)

    def _begin(self, data: bytearray) -> bool:
        start = len(data[:8]) - len(data[:8].lstrip(_LINE_ENDS))
        for magic, is_jpeg in ((JPEG_START, True), (PNG_START, False)):
            if data.startswith(magic, start):
                self._is_jpeg, self.is_marked = is_jpeg, True
                self._at = start + (2 if is_jpeg else len(magic))
                return True
        return False

    def _find_jpeg_end(self, data: bytearray) -> int | None:
        at = self._at or 0
        while at + 1 < len(data):
            if self._is_in_scan:
                found = _MARKER_IN_SCAN.search(data, at)
                if found is None:
                    at = len(data) - 1  # its last byte may begin a marker
                    break
                at = found.start()
                self._is_in_scan = data[at + 1] not in _AFTER_SCAN and data[at + 1] != _END
                if self._is_in_scan:  # no marker that can stand here: damage
                    at += 1
                    continue
            kind = data[at + 1]
            if data[at] != 0xFF:
                self._is_in_scan = True  # damage among the segments: look on as in a scan
            elif kind == _END:
                return at + 2
            elif kind == _FILL:
                at += 1
            elif kind in _BARE:
                at += 2
            elif at + 3 < len(data):
                self._is_in_scan = kind == _SCAN
                at += 2 + int.from_bytes(data[at + 2 : at + 4])
            else:
                break
        self._at = at
        return None

    def _find_png_end(self, data: bytearray) -> int | None:
        at = self._at or 0
        while at + 8 <= len(data):
            end = at + 12 + int.from_bytes(data[at : at + 4])
            if data[at + 4 : at + 8] == b"IEND":
                return end if end <= len(data) else None
            at = end
        self._at = at
        return None
