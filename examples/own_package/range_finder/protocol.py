r"""Wire format of the range finder: lines to readings and back, pure.

The device looks along body +x and sends one line per measurement, 115200 Bd, 8N1::

    $LRF,<number>,<millimetres>*<checksum>\r\n        $LRF,17,1655.2*45
    $LRF,<number>,*<checksum>\r\n                     $LRF,18,*51         (no echo)

``number`` counts measurements, 0 to 65535 and again. ``checksum`` is the exclusive or of all bytes between
``$`` and ``*``, two hexadecimal digits (as in NMEA 0183).
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import reduce
from operator import xor

MAX_LINE_BYTES = 32
NUMBERS = 1 << 16
_LINE = re.compile(rb"\$(LRF,(\d{1,5}),(\d{1,6}\.\d)?)\*([0-9A-F]{2})\r")


@dataclass(frozen=True, slots=True)
class Reading:
    """One measurement.

    Attributes:
        number: Its number, modulo ``NUMBERS``.
        distance_m: None without an echo.
    """

    number: int
    distance_m: float | None


def encode(reading: Reading) -> bytes:
    """The line of a reading."""
    millimetres = "" if reading.distance_m is None else f"{reading.distance_m * 1e3:.1f}"
    body = f"LRF,{reading.number},{millimetres}".encode()
    return b"$%s*%02X\r\n" % (body, reduce(xor, body))


class LineParser:
    """Cuts readings out of a stream that may begin and break anywhere; noise is counted, never raised.

    Attributes:
        lines_refused: Lines that are none of the device's, or whose checksum is wrong.
        lines_lost: Numbers that are missing between the readings so far.
    """

    def __init__(self) -> None:
        self.lines_refused = 0
        self.lines_lost = 0
        self._begun = b""
        self._is_synchronised = False
        self._last: int | None = None

    def feed(self, data: bytes) -> Iterator[Reading]:
        """Yield every reading that these bytes complete."""
        *lines, self._begun = (self._begun + data).split(b"\n")
        self._begun = self._begun[-MAX_LINE_BYTES:]  # a longer line is refused at its end
        for line in lines:
            reading = _parse(line)
            if reading is not None:
                self._count(reading.number)
                yield reading
            elif self._is_synchronised:  # the first one may have begun before we listened
                self.lines_refused += 1
            self._is_synchronised = True

    def _count(self, number: int) -> None:
        if self._last is not None:
            self.lines_lost += (number - self._last - 1) % NUMBERS
        self._last = number


def _parse(line: bytes) -> Reading | None:
    found = _LINE.fullmatch(line, max(line.rfind(b"$"), 0))  # the end of the line before may be damaged
    if found is None or reduce(xor, found[1]) != int(found[4], 16) or int(found[2]) >= NUMBERS:
        return None
    return Reading(int(found[2]), None if found[3] is None else float(found[3]) * 1e-3)
