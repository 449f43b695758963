r"""The adapter's side of the Lawicel ASCII protocol: text lines to CAN frames and back, pure.

`S0\r` to `S8\r` bit rate, `O\r` open, `C\r` close, `tIIILDD..\r` a standard frame; each is answered by `\r`
(frames by `z\r`), nonsense by BEL. Source: Lawicel CANUSB manual; only 11-bit data frames are spoken here.
"""

from drivers.valve_bus.protocol import CanFrame

OK = b"\r"
SENT = b"z\r"
BELL = b"\x07"
_VERSION = b"V1013\r"
_SERIAL_NUMBER = b"NEMU1\r"
_MAX_LINE_BYTES = 32  # the longest valid line has 22
_FRAME_HEAD = 5  # t, three digits of identifier, one of length


def encode_frame(frame: CanFrame) -> bytes:
    """The line of a received frame."""
    return f"t{frame.arbitration_id:03X}{len(frame.data)}{frame.data.hex().upper()}\r".encode("ascii")


class SlcanSession:
    """One client of the adapter.

    Attributes:
        is_open: Whether the client wants frames.
        refused_lines: Lines answered by BEL.
    """

    def __init__(self) -> None:
        self.is_open = False
        self.refused_lines = 0
        self._line = bytearray()

    def feed(self, data: bytes) -> tuple[list[CanFrame], bytes]:
        """Take bytes in any pieces; return the frames the client sends and the answers to it."""
        frames: list[CanFrame] = []
        answers = bytearray()
        *lines, rest = (bytes(self._line) + data).split(b"\r")
        if len(rest) > _MAX_LINE_BYTES:
            rest = rest[-_MAX_LINE_BYTES:]
        self._line = bytearray(rest)
        for line in lines:
            answer = self._answer(line, frames)
            self.refused_lines += answer == BELL
            answers += answer
        return frames, bytes(answers)

    def _answer(self, line: bytes, frames: list[CanFrame]) -> bytes:
        match line[:1]:
            case b"":
                return OK
            case b"O" | b"L":
                self.is_open = True
                return OK
            case b"C":
                self.is_open = False
                return OK
            case b"S" | b"s" | b"M" | b"m" | b"Z" | b"X":
                return OK
            case b"V" | b"v":
                return _VERSION
            case b"N":
                return _SERIAL_NUMBER
            case b"F":
                return b"F00\r"
            case b"t" if self.is_open:
                frame = _decode_frame(line)
                if frame is not None:
                    frames.append(frame)
                    return SENT
        return BELL


def _decode_frame(line: bytes) -> CanFrame | None:
    try:
        text = line.decode("ascii")
        identifier, length = int(text[1:4], 16), int(text[4:_FRAME_HEAD])
        data = bytes.fromhex(text[_FRAME_HEAD : _FRAME_HEAD + 2 * length])
        return CanFrame(identifier, data) if len(data) == length else None
    except ValueError:
        return None
