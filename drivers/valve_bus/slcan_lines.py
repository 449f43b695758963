r"""Reads a serial CAN adapter (Lawicel ASCII) in blocks: byte by byte, as python-can does, a flood is faster.

`tIIILDD..\r` is a standard frame; answers (`\r`, `z\r`, BEL) and other lines are passed over.
"""

import os
import select

from drivers.valve_bus.frame import CanFrame

_READ_BYTES = 1 << 16
_LONGEST_LINE = 40
_HEAD = 5  # t, three digits of identifier, one of length


class SlcanLines:
    """Frames out of the adapter's stream.

    Args:
        descriptor: Of the open port or socket.

    Attributes:
        garbled: Lines that are no frame and no answer.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._rest = b""
        self.garbled = 0

    def read(self, timeout_s: float) -> list[CanFrame]:
        """All frames that are there, waited for up to a time.

        Raises:
            OSError: The adapter is gone.
        """
        ready, _, _ = select.select([self._descriptor], [], [], timeout_s)
        if not ready:
            return []
        try:
            data = os.read(self._descriptor, _READ_BYTES)
        except BlockingIOError:
            return []
        if not data:
            raise ConnectionError("the other end closed the line")
        *lines, self._rest = (self._rest + data).replace(b"\a", b"\r").split(b"\r")
        if len(self._rest) > _LONGEST_LINE:
            self.garbled += 1
            self._rest = b""
        frames = (self._frame(line) for line in lines)
        return [frame for frame in frames if frame is not None]

    def _frame(self, line: bytes) -> CanFrame | None:
        if line[:1] == b"t":
            try:
                text = line.decode("ascii")
                length = int(text[4:_HEAD])
                data = bytes.fromhex(text[_HEAD : _HEAD + 2 * length])
                if len(data) == length:
                    return CanFrame(int(text[1:4], 16), data)
            except ValueError:
                pass
            self.garbled += 1
        elif not line.isascii():
            self.garbled += 1
        return None
