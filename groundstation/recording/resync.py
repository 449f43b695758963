"""Walks the records of a file that may be damaged anywhere: what is no record is passed over.

A record is believed where its content is as long as its own parts say: a length that was hit does not lead
away from the records behind it. Of messages outside chunks, whose content says nothing, it is asked what
follows.

Source: MCAP specification, version 0.
"""

import re
from bisect import bisect_left
from collections.abc import Iterator, Sequence
from mmap import mmap
from struct import Struct
from typing import NamedTuple

from groundstation.recording.records import MAGIC, MESSAGE, RECORD, Opcode, Record

_U32, _U64 = Struct("<I"), Struct("<Q")
_LAYOUTS: dict[int, tuple[int | str, ...]] = {  # bytes, or "text" with u32 before it, or "data" with u64
    0x01: ("text", "text"),  # header
    0x02: (20,),  # footer
    0x03: (2, "text", "text", "text"),  # schema
    0x04: (4, "text", "text", "text"),  # channel
    0x06: (28, "text", "data"),  # chunk
    0x07: (2, "text"),  # message index
    0x08: (32, "text", 8, "text", 16),  # chunk index
    0x09: (16, "text", "text", "data", 4),  # attachment
    0x0A: (40, "text", "text"),  # attachment index
    0x0B: (42, "text"),  # statistics
    0x0C: ("text", "text"),  # metadata
    0x0D: (16, "text"),  # metadata index
    0x0E: (17,),  # summary offset
    0x0F: (4,),  # end of data
}
_BEGINNING = re.compile(rb"(?s)(?=[\x01-\x0f].{4}\x00{4})")  # of a record of less than 4 GiB
_WITNESSES = 2
"""So many records must follow a message that is found by searching."""

Data = bytes | mmap


class Lost(NamedTuple):
    """Bytes that are no record."""

    start: int
    stop: int


def walk(data: Data, position: int = 0, listed: Sequence[int] = ()) -> Iterator[Record | Lost]:
    """Give every record from ``position`` on, and what lies between them.

    The magic bytes at the end belong to none. What is torn at the end is lost, too.

    Args:
        data: Of the file.
        position: Where to begin.
        listed: Where an index says that chunks begin, in order: no other record reaches across such a place.
    """
    chunks = [start for start in listed if is_chunk_at(data, start)]
    end = len(data)
    while position < end:
        if end - position == len(MAGIC) and data[position:end] == MAGIC:
            return
        place = bisect_left(chunks, position + 1)
        limit = chunks[place] if place < len(chunks) else end
        record = _record_at(data, position)
        if record is not None and record.stop > limit:
            record = None
        if record is not None and (record.opcode != Opcode.MESSAGE or _is_followed(data, record.stop, 1)):
            yield record
            position = record.stop
            continue
        start, position = position, min(_search(data, position + 1), limit)
        yield Lost(start, position)


def holds_messages(data: Data) -> bool:
    """Whether chunks or messages begin anywhere: a recovery brings back those that are not damaged."""
    for piece in walk(data, len(MAGIC) if data[: len(MAGIC)] == MAGIC else 0):
        if isinstance(piece, Record):
            if piece.opcode in (Opcode.CHUNK, Opcode.MESSAGE):
                return True
        elif piece.stop == len(data) and data[piece.start] == Opcode.CHUNK:
            return True  # it was being written
    return False


def is_chunk_at(data: Data, start: int) -> bool:
    """Whether a whole chunk record begins there."""
    record = _record_at(data, start)
    return record is not None and record.opcode == Opcode.CHUNK


def _search(data: Data, position: int) -> int:
    """Where the next record begins, or the end."""
    for found in _BEGINNING.finditer(data, position):
        record = _record_at(data, found.start())
        if record is None:
            continue
        is_said = record.opcode == Opcode.CHUNK
        if is_said or _is_followed(data, record.stop, _WITNESSES):
            return found.start()
    end = len(data)
    return end - len(MAGIC) if data[max(position, end - len(MAGIC)) : end] == MAGIC else end


def _is_followed(data: Data, position: int, count: int) -> bool:
    """Whether records follow, or the end of the file, or what was being written when it was torn."""
    for _ in range(count):
        if _ends_at(data, position):
            return True
        record = _record_at(data, position)
        if record is None:
            return False
        position = record.stop
    return True


def _ends_at(data: Data, position: int) -> bool:
    left = len(data) - position
    if left < RECORD.size:
        return True
    opcode, length = RECORD.unpack_from(data, position)
    is_torn = opcode in (*_LAYOUTS, Opcode.MESSAGE) and left - RECORD.size < length < 1 << 32
    return bool(is_torn) or data[position : position + len(MAGIC)] in (MAGIC, bytes(len(MAGIC)))


def _record_at(data: Data, position: int) -> Record | None:
    """The record that begins here, if it is whole and as long as its parts say."""
    if position + RECORD.size > len(data):
        return None
    opcode, length = RECORD.unpack_from(data, position)
    start = position + RECORD.size
    stop = start + length
    if stop > len(data):
        return None
    if opcode == Opcode.MESSAGE:
        return Record(opcode, start, stop) if length >= MESSAGE.size else None
    layout = _LAYOUTS.get(opcode)
    if layout is None:
        return None
    place = start
    for part in layout:
        if isinstance(part, int):
            place += part
            continue
        size = _U32 if part == "text" else _U64
        if place + size.size > stop:
            return None
        place += size.size + size.unpack_from(data, place)[0]
    return Record(opcode, start, stop) if place == stop else None
