"""Writes MCAP files: chunked, compressed, indexed, byte for byte as the library ``mcap`` at the same level.

Messages are most of what a recording holds, so their records and indexes are packed in one piece each, which
takes a fifth of the time of the library; the few other records are left to it.

Source: MCAP specification, version 0.
"""

import struct
import zlib
from collections.abc import Iterable
from typing import BinaryIO, Protocol

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from groundstation.recording.records import MAGIC, RECORD
from groundstation.recording.written_chunks import ENTRY_BYTES, INDEX, WrittenChunks

CHUNK_BYTES = 1 << 20
_COMPRESSION = "zstd"
LEVEL = 1
"""Of zstd: dark pictures take half the time of the default level and come out smaller, the rest is equal."""
_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_HEAD = _MESSAGE.size - RECORD.size
_CHUNK = struct.Struct("<BQQQQII4sQ")
_CHUNK_INDEX_BYTES = 128
"""Of a chunk in the summary, beside ten for each of its channels."""
_FIXED_SUMMARY_BYTES = 4096
"""Statistics without channels, offsets and footer, generously."""
_NEVER_NS = 2**64 - 1
_FOOTER_CRC = struct.Struct("<BQQQ")


class _Record(Protocol):
    def write(self, stream: RecordBuilder) -> None: ...


class McapFile:
    """One MCAP file in the making.

    Args:
        file: Open for writing at its beginning; it stays open.
        profile: Of the file.
        library: What wrote it.
    """

    def __init__(self, file: BinaryIO, profile: str, library: str) -> None:
        self._file = file
        self._compress = zstandard.ZstdCompressor(level=LEVEL).compress
        self._parts: list[bytes] = []  # of the open chunk
        self._size = 0
        self._stamps_and_offsets: dict[int, list[int]] = {}  # of the open chunk, by channel
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._definitions: list[bytes] = []  # records of both, in the order of their coming
        self._metadata: list[MetadataIndex] = []
        self._chunks = WrittenChunks(_COMPRESSION)
        self._first_ns, self._last_ns = _NEVER_NS, 0
        self._counts: dict[int, int] = {}
        self._summary_bytes = _FIXED_SUMMARY_BYTES
        file.write(MAGIC + _packed(Header(profile, library)))

    @property
    def rest_bytes(self) -> int:
        """At most so many bytes are still to be written if the file is finished now."""
        indexes = 2 * INDEX.size * len(self._stamps_and_offsets)
        stamps = sum(8 * len(index) for index in self._stamps_and_offsets.values())
        return self._summary_bytes + self._size + indexes + stamps + _CHUNK_INDEX_BYTES

    def add_metadata(self, name: str, entries: dict[str, str]) -> None:
        """Write a metadata record."""
        record = _packed(Metadata(name=name, metadata=entries))
        index = MetadataIndex(offset=self._file.tell(), length=len(record), name=name)
        self._file.write(record)
        self._summary_bytes += 64 + len(name)
        self._metadata.append(index)

    def add_schema(self, name: str, encoding: str, text: bytes) -> int:
        """Add a schema; return its number."""
        schema = Schema(id=len(self._schemas) + 1, data=text, encoding=encoding, name=name)
        self._schemas.append(schema)
        self._add(_packed(schema))
        return schema.id

    def add_channel(self, topic: str, encoding: str, schema: int) -> int:
        """Add a channel of a schema's number; return its own."""
        number = len(self._channels) + 1
        channel = Channel(id=number, topic=topic, message_encoding=encoding, schema_id=schema, metadata={})
        self._channels.append(channel)
        self._add(_packed(channel))
        return number

    def repeat_definitions(self) -> None:
        """Write every schema and channel once more, into the open chunk.

        Readers without an index, of a file that was not finished, know the channels though the chunk that
        named them first is lost.
        """
        self._parts += self._definitions
        self._size += sum(map(len, self._definitions))

    def add_message(self, channel: int, log_ns: int, data: bytes, publish_ns: int, sequence: int) -> None:
        """Add a message to the open chunk; a chunk that is full is written."""
        head = _MESSAGE.pack(Opcode.MESSAGE, _MESSAGE_HEAD + len(data), channel, sequence, log_ns, publish_ns)
        index = self._stamps_and_offsets.get(channel)
        if index is None:
            index = self._stamps_and_offsets[channel] = []
        index += (log_ns, self._size)
        self._parts += (head, data)
        self._size += _MESSAGE.size + len(data)
        if self._size > CHUNK_BYTES:
            self._finish_chunk()

    def flush(self) -> None:
        """Write the open chunk; one without messages stays open."""
        self._finish_chunk()
        self._file.flush()

    def drop_open_chunk(self) -> int:
        """Forget the messages that are not written yet; return how many they are."""
        dropped = sum(len(index) // 2 for index in self._stamps_and_offsets.values())
        self._parts.clear()
        self._stamps_and_offsets.clear()
        self._size = 0
        return dropped

    def finish(self) -> None:
        """Write the rest, the summary and the end of the file."""
        self._finish_chunk()
        end = _packed(DataEnd(0))
        start = self._file.tell() + len(end)
        summary, offsets = b"", b""
        for opcode, records in self._summary():
            group = b"".join(records)
            offsets += _packed(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        offset_start = start + len(summary)
        footer = _FOOTER_CRC.pack(Opcode.FOOTER, 20, start, offset_start)
        crc = zlib.crc32(footer, zlib.crc32(summary + offsets))
        # one piece, like a chunk with its indexes: a disk that is full takes all of it or nothing
        self._file.write(end + summary + offsets + _packed(Footer(start, offset_start, crc)) + MAGIC)

    def _summary(self) -> Iterable[tuple[Opcode, Iterable[bytes]]]:
        yield Opcode.SCHEMA, map(_packed, self._schemas)
        yield Opcode.CHANNEL, map(_packed, self._channels)
        yield Opcode.STATISTICS, [_packed(self._statistics())]
        yield Opcode.CHUNK_INDEX, self._chunks.records()
        yield Opcode.ATTACHMENT_INDEX, ()
        yield Opcode.METADATA_INDEX, map(_packed, self._metadata)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=self._last_ns,
            message_start_time=self._first_ns if self._chunks else 0,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )

    def _add(self, record: bytes) -> None:
        self._summary_bytes += len(record) + 16  # schemas and channels are in the summary once more
        self._definitions.append(record)
        self._parts.append(record)
        self._size += len(record)
        if self._size > CHUNK_BYTES:
            self._finish_chunk()

    def _finish_chunk(self) -> None:
        if not self._stamps_and_offsets:
            return
        records = b"".join(self._parts)
        packed = self._compress(records)
        low_ns = min(min(index[::2]) for index in self._stamps_and_offsets.values())
        high_ns = max(max(index[::2]) for index in self._stamps_and_offsets.values())
        start = self._file.tell()
        length = _CHUNK.size + len(packed)
        head = _CHUNK.pack(
            Opcode.CHUNK,
            length - RECORD.size,
            low_ns,
            high_ns,
            len(records),
            zlib.crc32(records),
            len(_COMPRESSION),
            _COMPRESSION.encode(),
            len(packed),
        )
        self._file.write(b"".join((head, packed, self._packed_indexes())))
        messages = {channel: len(index) // 2 for channel, index in self._stamps_and_offsets.items()}
        for channel, count in messages.items():
            self._counts[channel] = self._counts.get(channel, 0) + count
        self._chunks.add(start, (length, len(packed), len(records)), (low_ns, high_ns), messages)
        self._first_ns, self._last_ns = min(self._first_ns, low_ns), max(self._last_ns, high_ns)
        self._summary_bytes += _CHUNK_INDEX_BYTES + 10 * len(messages)
        self._parts.clear()
        self._stamps_and_offsets.clear()
        self._size = 0

    def _packed_indexes(self) -> bytearray:
        """The index of each channel: log time and offset of every message."""
        out = bytearray()
        for channel, index in self._stamps_and_offsets.items():
            size = len(index) // 2 * ENTRY_BYTES
            out += INDEX.pack(Opcode.MESSAGE_INDEX, INDEX.size - RECORD.size + size, channel, size)
            out += struct.pack(f"<{len(index)}Q", *index)
        return out


def _packed(record: _Record) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]  # unannotated in mcap
