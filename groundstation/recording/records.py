"""The MCAP records that reading and recovery need, cut out of bytes that may end anywhere.

Source: MCAP specification, version 0: little endian; a record is ``opcode u8 | length u64 | content``;
strings are prefixed with a u32 length.
"""

import struct
import zlib
from collections.abc import Container, Iterator
from dataclasses import dataclass
from enum import IntEnum
from mmap import mmap
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]  # ships no types
import zstandard

MAGIC = b"\x89MCAP0\r\n"
RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQI")
_CHANNEL = struct.Struct("<HH")
MESSAGE = struct.Struct("<HIQQ")
_INDEX = struct.Struct("<HI")
_START = struct.Struct("<B8xH")
_U16 = struct.Struct("<H")
_U32 = struct.Struct("<I")
_U64 = struct.Struct("<Q")


class Opcode(IntEnum):
    """Kinds of records that are looked at; others are skipped."""

    HEADER = 0x01
    FOOTER = 0x02
    SCHEMA = 0x03
    CHANNEL = 0x04
    MESSAGE = 0x05
    CHUNK = 0x06
    MESSAGE_INDEX = 0x07
    CHUNK_INDEX = 0x08
    STATISTICS = 0x0B
    METADATA = 0x0C
    METADATA_INDEX = 0x0D
    DATA_END = 0x0F


class DamagedChunkError(ValueError):
    """A chunk that cannot be unpacked, or whose checksum is wrong."""


_MESSAGE = Opcode.MESSAGE.value
_MESSAGE_INDEX = Opcode.MESSAGE_INDEX.value


class Record(NamedTuple):
    """One complete record: its kind and where its content lies in the bytes it was cut from."""

    opcode: int
    start: int
    stop: int


class Schema(NamedTuple):
    """A schema record."""

    number: int
    name: str
    encoding: str
    data: bytes


class Channel(NamedTuple):
    """A channel record; its own metadata is not used."""

    number: int
    schema: int
    topic: str
    encoding: str


@dataclass(frozen=True, slots=True)
class Chunk:
    """A chunk record, possibly cut off within its data."""

    uncompressed_size: int
    crc: int
    compression: str
    data: bytes
    complete: bool

    def unpack(self) -> bytes:
        """The records inside.

        Raises:
            DamagedChunkError: The data does not unpack or the checksum is wrong.
        """
        out = self.unpack_what_is_there()
        if len(out) != self.uncompressed_size or (self.crc and zlib.crc32(out) != self.crc):
            raise DamagedChunkError("checksum or size of a chunk is wrong")
        return out

    def unpack_what_is_there(self) -> bytes:
        """As much of the records inside as the data at hand gives; compressors work in blocks.

        Raises:
            DamagedChunkError: The data is not what the chunk gives it is.
        """
        try:
            if self.compression == "zstd":
                return zstandard.ZstdDecompressor().decompressobj().decompress(self.data)
            if self.compression == "lz4":
                unpacked: bytes = lz4.frame.LZ4FrameDecompressor().decompress(self.data)
                return unpacked
        except (zstandard.ZstdError, RuntimeError) as error:
            raise DamagedChunkError(f"a chunk does not unpack: {error}") from error
        if self.compression:
            raise DamagedChunkError(f"compression {self.compression!r} is not known")
        return self.data


def complete_records(data: bytes | mmap, position: int = 0) -> Iterator[Record]:
    """Records that are complete in ``data``, from ``position`` on; stops before the first that is not.

    Opcode 0 is no record: a file system that lost power leaves runs of zeros.
    """
    end, head, unpack = len(data), RECORD.size, RECORD.unpack_from
    while position + head <= end:
        opcode, length = unpack(data, position)
        start = position + head
        position = start + length
        if position > end or opcode == 0:
            return
        yield Record(opcode, start, position)


def read_chunk(content: bytes) -> Chunk | None:
    """A chunk from the content of its record, which may be cut off; None if not even its head is there."""
    try:
        _, _, size, crc = _CHUNK.unpack_from(content)
        compression, position = _text(content, _CHUNK.size)
        (length,) = _U64.unpack_from(content, position)
    except (struct.error, ValueError):
        return None
    data = content[position + 8 : position + 8 + length]
    return Chunk(size, crc, compression, data, len(data) == length)


def read_header(content: bytes) -> tuple[str, str]:
    """Profile and library."""
    profile, position = _text(content, 0)
    return profile, _text(content, position)[0]


def read_schema(content: bytes) -> Schema:
    """A schema record."""
    (number,) = _U16.unpack_from(content)
    name, position = _text(content, 2)
    encoding, position = _text(content, position)
    (length,) = _U32.unpack_from(content, position)
    return Schema(number, name, encoding, content[position + 4 : position + 4 + length])


def read_channel(content: bytes) -> Channel:
    """A channel record."""
    number, schema = _CHANNEL.unpack_from(content)
    topic, position = _text(content, _CHANNEL.size)
    return Channel(number, schema, topic, _text(content, position)[0])


def message_places(data: bytes, indexes: bytes, wanted: Container[int]) -> dict[int, list[int]]:
    """Where the message records of each channel begin in the records of a chunk.

    The indexes are outside what the chunk's checksum covers: where they are not whole, records are walked.

    Args:
        data: The records.
        indexes: Index records of the chunk, one per channel; empty where there are none.
        wanted: Numbers of the channels.
    """
    found = _indexed_places(data, indexes, wanted) if indexes else None
    return _walked_places(data, wanted) if found is None else found


def _walked_places(data: bytes, wanted: Container[int]) -> dict[int, list[int]]:
    found: dict[int, list[int]] = {}
    for opcode, start, _ in complete_records(data):
        if opcode == _MESSAGE:
            number = MESSAGE.unpack_from(data, start)[0]
            if number in wanted:
                found.setdefault(number, []).append(start - RECORD.size)
    return found


def _indexed_places(data: bytes, indexes: bytes, wanted: Container[int]) -> dict[int, list[int]] | None:
    """The same by the indexes; None where they are not what a writer makes of these records."""
    found: dict[int, list[int]] = {}
    last, stop = len(data) - RECORD.size - MESSAGE.size, 0
    for opcode, start, stop in complete_records(indexes):
        if opcode != _MESSAGE_INDEX or stop - start < _INDEX.size:
            return None
        number, size = _INDEX.unpack_from(indexes, start)
        if size != stop - start - _INDEX.size or size % 16:
            return None
        if number not in wanted:
            continue
        places = list(struct.unpack_from(f"<{size // 8}Q", indexes, start + _INDEX.size)[1::2])
        if number in found or sorted(set(places)) != places:
            return None
        for place in places:
            if place > last or _START.unpack_from(data, place) != (_MESSAGE, number):
                return None
        found[number] = places
    return found if stop == len(indexes) else None


def read_metadata(content: bytes) -> tuple[str, dict[str, str]]:
    """Name and entries of a metadata record."""
    name, position = _text(content, 0)
    (length,) = _U32.unpack_from(content, position)
    position += 4
    end = position + length
    entries = {}
    while position < end:
        key, position = _text(content, position)
        entries[key], position = _text(content, position)
    return name, entries


def _text(content: bytes, position: int) -> tuple[str, int]:
    (length,) = _U32.unpack_from(content, position)
    start = position + 4
    if length > len(content) - start:
        raise ValueError("a text is cut off")
    return content[start : start + length].decode(), start + length
