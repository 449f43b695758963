"""Where the chunks of a file in the making lie, kept small until the summary is written.

An hour has fifteen thousand chunks of fifty channels each. What their index records state follows from a few
numbers and from how many messages each channel has in a chunk, which is nearly the same in all: packed
together they take a tenth of the records, and one growing piece of memory instead of thousands of small ones
between which the heap tears.
"""

import struct
from collections.abc import Iterator, Mapping

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex

INDEX = struct.Struct("<BQHI")
"""Head of a message index: opcode, length, channel, bytes of its entries."""
ENTRY_BYTES = 16
"""Of a message in a message index: log time and offset."""
_CHUNK = struct.Struct("<QQQQQQH")
_CHANNEL = struct.Struct("<HI")
_BATCH = struct.Struct("<II")
_CHUNKS_PER_BATCH = 64


class WrittenChunks:
    """The chunks of one file, in its order.

    Args:
        compression: Name of how the chunks are compressed.
    """

    def __init__(self, compression: str) -> None:
        self._compression = compression
        self._count = 0
        self._open = bytearray()
        self._packed = bytearray()
        self._compress = zstandard.ZstdCompressor(level=1).compress

    def __len__(self) -> int:
        return self._count

    def add(
        self, start: int, sizes: tuple[int, int, int], span_ns: tuple[int, int], messages: Mapping[int, int]
    ) -> None:
        """Add a chunk.

        Args:
            start: Where it begins in the file.
            sizes: Bytes of its record, of its compressed and of its plain content.
            span_ns: First and last log time.
            messages: How many each channel has, in the order of their message indexes behind the chunk.
        """
        self._open += _CHUNK.pack(start, *sizes, *span_ns, len(messages))
        for channel, count in messages.items():
            self._open += _CHANNEL.pack(channel, count)
        self._count += 1
        if self._count % _CHUNKS_PER_BATCH == 0:
            packed = self._compress(self._open)
            self._packed += _BATCH.pack(len(packed), len(self._open))
            self._packed += packed
            self._open.clear()

    def records(self) -> Iterator[bytes]:
        """The index record of each chunk."""
        decompress = zstandard.ZstdDecompressor().decompress
        position = 0
        while position < len(self._packed):
            length, plain = _BATCH.unpack_from(self._packed, position)
            position += _BATCH.size
            yield from self._unpacked(decompress(self._packed[position : position + length], plain))
            position += length
        yield from self._unpacked(bytes(self._open))

    def _unpacked(self, batch: bytes) -> Iterator[bytes]:
        position = 0
        while position < len(batch):
            start, length, packed, plain, low_ns, high_ns, channels = _CHUNK.unpack_from(batch, position)
            position += _CHUNK.size
            offsets, indexes = {}, 0
            for channel, count in _CHANNEL.iter_unpack(batch[position : position + channels * _CHANNEL.size]):
                offsets[channel] = start + length + indexes
                indexes += INDEX.size + count * ENTRY_BYTES
            position += channels * _CHANNEL.size
            listed = ChunkIndex(
                chunk_length=length,
                chunk_start_offset=start,
                compression=self._compression,
                compressed_size=packed,
                message_end_time=high_ns,
                message_index_length=indexes,
                message_index_offsets=offsets,
                message_start_time=low_ns,
                uncompressed_size=plain,
            )
            builder = RecordBuilder()
            listed.write(builder)
            yield bytes(builder.end())  # type: ignore[no-untyped-call]  # unannotated in mcap
