"""Whether the data of a JPEG are used up when its last block is decoded; pure.

Behind a wrong bit a Huffman code falls into step again after some blocks too many or too few. Where data
lack the decoder says so; of those that are left it reads eight bytes ahead and says nothing. Without its last
byte a whole picture lacks something, and one that has data left does not.
"""

import simplejpeg

_END = b"\xff\xd9"
_SCAN, _WITHOUT_LENGTH = 0xDA, frozenset({0x01, *range(0xD0, 0xD9)})
_SEQUENTIAL = frozenset({0xC0, 0xC1})
"""Frames of one scan by Huffman codes; in others a last scan may hold next to nothing."""


def is_used_up(file: bytes) -> bool:
    """Say whether nothing is left of the data of a JPEG; True where that cannot be told.

    Args:
        file: From the start marker to the end marker; the decoder had nothing to complain about.
    """
    if not _is_sequential(file):
        return True
    data = file[: -len(_END)]
    while data[-1:] in (
        b"\0",
        b"\xff",
    ):  # what encoders fill up with, and a full byte with the nought behind it
        data = data[:-1]
    try:
        simplejpeg.decode_jpeg(data[:-1] + _END, "GRAY", strict=True)
    except ValueError:
        return True
    return False


def _is_sequential(file: bytes) -> bool:
    at, is_found = 2, False
    while at + 4 <= len(file) and file[at] == 0xFF:
        marker = file[at + 1]
        if marker == _SCAN:
            return is_found
        is_found |= marker in _SEQUENTIAL
        at += 1 if marker == 0xFF else 2
        if marker != 0xFF and marker not in _WITHOUT_LENGTH:
            at += int.from_bytes(file[at : at + 2], "big")
    return False
