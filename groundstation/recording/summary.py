"""The index at the end of a finished MCAP file: what channels there are, and which chunk holds what.

An hour's recording lists fifteen thousand chunks with sixty channels each, so the lists of channels are read
by NumPy when they are first asked for, and opening a file costs a few hundredths of a second.

Source: MCAP specification, version 0: footer, chunk index, statistics, metadata index.
"""

import os
import struct
import zlib
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from mmap import mmap
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.recording import records
from groundstation.recording.errors import RecordingError
from groundstation.recording.records import MAGIC, Channel, Opcode, Schema

_FOOTER = struct.Struct("<BQQQI")
_CHUNK_INDEX = struct.Struct("<QQQQI")
_U32, _U64 = struct.Struct("<I"), struct.Struct("<Q")
_STATISTICS = struct.Struct("<QHIIIIQQI")
_CHANNEL_ENTRY = np.dtype([("channel", "<u2"), ("place", "<u8")])
"""Of a chunk in the index: a channel, and where its own index lies."""


class UnfinishedError(RecordingError):
    """The file has no index, or a damaged one."""


class ListedChunk(NamedTuple):
    """A chunk as the index lists it.

    Attributes:
        start_ns: Least log time in it.
        stop_ns: Largest log time in it.
        offset: Where its record begins in the file.
        length: Of its record.
        index_length: Of the indexes of its channels, which follow it.
        entries: Bytes of the list of these channels; empty where there is none.
    """

    start_ns: int
    stop_ns: int
    offset: int
    length: int
    index_length: int
    entries: bytes

    @property
    def channels(self) -> frozenset[int]:
        """Numbers of the channels it holds; empty where it has no indexes."""
        return frozenset(np.frombuffer(self.entries, _CHANNEL_ENTRY)["channel"].tolist())


@dataclass(slots=True)
class Statistics:
    """What the file states about its messages."""

    start_ns: int = 0
    stop_ns: int = 0
    counts: dict[int, int] = field(default_factory=dict)


@dataclass(eq=False)
class Summary:
    """The index of one file.

    Attributes:
        schemas: By number.
        channels: By number.
        statistics: Counts by channel, and the span of the log times.
        chunks: In the order of their least log times.
        metadata_places: Offset and length of each metadata record.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    statistics: Statistics = field(default_factory=Statistics)
    chunks: list[ListedChunk] = field(default_factory=list)
    metadata_places: list[tuple[int, int]] = field(default_factory=list)

    def chunks_with(self, channels: Collection[int], low_ns: int = 0, high_ns: int = 1 << 64) -> list[int]:
        """Positions of the chunks that may hold something of these channels from ``low_ns`` to ``high_ns``.

        Args:
            channels: Numbers.
            low_ns: Least log time.
            high_ns: Log times stay below.
        """
        if not channels:
            return []
        starts_ns, stops_ns = self._spans
        by_channel, holds = self._by_channel, np.zeros(len(self.chunks), bool)
        holds[self._unlisted] = True
        for number in channels:
            if number in by_channel:
                holds[by_channel[number]] = True
        low, high = np.uint64(max(low_ns, 0)), np.uint64(min(max(high_ns, 0), (1 << 64) - 1))
        found: list[int] = np.flatnonzero(holds & (stops_ns >= low) & (starts_ns < high)).tolist()
        return found

    def last_chunks(self, channel: int, at_ns: int) -> Iterator[int]:
        """Positions of the chunks that may hold something of a channel up to ``at_ns``, newest first."""
        places = self._by_channel.get(channel, self._unlisted)
        begun = places[self._spans[0][places] <= np.uint64(min(max(at_ns, 0), (1 << 64) - 1))]
        return map(int, begun[::-1])

    @cached_property
    def _spans(self) -> tuple[NDArray[np.uint64], NDArray[np.uint64]]:
        starts_ns = np.array([chunk.start_ns for chunk in self.chunks], np.uint64)
        return starts_ns, np.array([chunk.stop_ns for chunk in self.chunks], np.uint64)

    @cached_property
    def _unlisted(self) -> NDArray[np.int64]:
        """Chunks without a list of their channels: they may hold any."""
        places = [place for place, chunk in enumerate(self.chunks) if not chunk.entries]
        return np.array(places, np.int64)

    @cached_property
    def _by_channel(self) -> dict[int, NDArray[np.int64]]:
        entries = np.frombuffer(b"".join([chunk.entries for chunk in self.chunks]), _CHANNEL_ENTRY)
        counts = [len(chunk.entries) // _CHANNEL_ENTRY.itemsize for chunk in self.chunks]
        places = np.repeat(np.arange(len(self.chunks)), counts)
        order = np.argsort(entries["channel"], kind="stable")
        numbers, begins = np.unique(entries["channel"][order], return_index=True)
        pieces = np.split(places[order], begins[1:]) if len(numbers) else []
        return dict(zip(numbers.tolist(), pieces, strict=True))


def read_summary(file: int, size: int) -> Summary:
    """Read the index of a finished file.

    Args:
        file: Descriptor; its position does not change.
        size: Of the file.

    Raises:
        UnfinishedError: There is none, or it is damaged.
        struct.error, ValueError: It holds something else.
    """
    return _summary(lambda length, offset: os.pread(file, length, offset), size)


def summary_of(data: bytes | mmap) -> Summary:
    """Read the index of a file that is in memory.

    Raises:
        UnfinishedError: There is none, or it is damaged.
        struct.error, ValueError: It holds something else.
    """
    return _summary(lambda length, offset: data[offset : offset + length], len(data))


def _summary(read: Callable[[int, int], bytes], size: int) -> Summary:
    """Read by a function of length and offset."""
    end = size - len(MAGIC)
    tail = read(_FOOTER.size + len(MAGIC), max(end - _FOOTER.size, 0))
    if len(tail) != _FOOTER.size + len(MAGIC) or not tail.endswith(MAGIC):
        raise UnfinishedError("was not finished or is damaged")
    opcode, length, start, _, crc = _FOOTER.unpack_from(tail)
    if opcode != Opcode.FOOTER or length != _FOOTER.size - records.RECORD.size:
        raise UnfinishedError("was not finished or is damaged")
    if start == 0:
        raise UnfinishedError("has no index")
    if not len(MAGIC) <= start < end:
        raise UnfinishedError("was not finished or is damaged")
    section = read(end - 4 - start, start)
    if len(section) != end - 4 - start or (crc and zlib.crc32(section) != crc):
        raise UnfinishedError("was not finished or is damaged")
    return _parsed(section)


def _parsed(section: bytes) -> Summary:
    found, stated = Summary(), False
    for opcode, start, stop in records.complete_records(section):
        if opcode == Opcode.CHUNK_INDEX:
            found.chunks.append(_listed_chunk(section, start))
        elif opcode == Opcode.SCHEMA:
            schema = records.read_schema(section[start:stop])
            found.schemas[schema.number] = schema
        elif opcode == Opcode.CHANNEL:
            channel = records.read_channel(section[start:stop])
            found.channels[channel.number] = channel
        elif opcode == Opcode.STATISTICS:
            found.statistics, stated = _read_statistics(section, start), True
        elif opcode == Opcode.METADATA_INDEX:
            offset, length = struct.unpack_from("<QQ", section, start)
            found.metadata_places.append((offset, length))
    found.chunks.sort(key=lambda chunk: (chunk.start_ns, chunk.offset))
    if not stated and found.chunks:
        found.statistics.start_ns = found.chunks[0].start_ns
        found.statistics.stop_ns = max(chunk.stop_ns for chunk in found.chunks)
    return found


def _listed_chunk(section: bytes, start: int) -> ListedChunk:
    start_ns, stop_ns, offset, length, size = _CHUNK_INDEX.unpack_from(section, start)
    place = start + _CHUNK_INDEX.size
    if size % _CHANNEL_ENTRY.itemsize:
        raise ValueError("the list of a chunk's channels is cut off")
    entries = section[place : place + size]
    return ListedChunk(start_ns, stop_ns, offset, length, _U64.unpack_from(section, place + size)[0], entries)


def _read_statistics(section: bytes, start: int) -> Statistics:
    found = _STATISTICS.unpack_from(section, start)
    start_ns, stop_ns, size = found[-3:]
    place = start + _STATISTICS.size
    counts = np.frombuffer(section[place : place + size], _CHANNEL_ENTRY)
    return Statistics(
        start_ns, stop_ns, dict(zip(counts["channel"].tolist(), counts["place"].tolist(), strict=True))
    )
