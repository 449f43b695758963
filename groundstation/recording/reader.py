"""Reads a finished recording lazily, in the order of its log times.

The index at the end of the file states which chunks hold which channels; chunks are unpacked one at a
time, so that a recording of any length is read in little memory.
"""

import struct
from bisect import bisect_left
from collections.abc import Collection, Container, Iterator
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import ChunkIndex
from mcap.summary import Summary

from groundstation.bus.cdr import CodecError
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.declarations.message import Message
from groundstation.declarations.topic import Topic
from groundstation.recording.channel_names import parse_channel
from groundstation.recording.errors import RecordingError
from groundstation.recording.gaps import GAPS_NAME, Gap, from_metadata
from groundstation.recording.info import FORMAT, METADATA_NAME, RecordingInfo
from groundstation.recording.records import (
    MESSAGE,
    RECORD,
    DamagedChunkError,
    message_places,
    read_chunk,
)
from groundstation.recording.schemas import Decode, decoder_of

# what the library lets through when it meets the torn or garbled end of a file
_UNREADABLE = (McapError, EOFError, ValueError, KeyError, OverflowError, OSError, struct.error)


_log_ns = attrgetter("log_ns")


class Recorded(NamedTuple):
    """One recorded message, not yet decoded; a named tuple, since a recording holds millions.

    Attributes:
        envelope: Topic, owner, sequence and moment of publication. Wall time and causes are in the journal
            (``CauseIndex``); CPU time is not recorded.
        data: CDR bytes of the payload.
        log_ns: Log time.
        decode: Makes the payload of its class by the file's own schema.
    """

    envelope: Envelope
    data: bytes
    log_ns: int
    decode: Decode

    @property
    def payload(self) -> Message:
        """The payload, decoded anew at each call; CodecError if the bytes are no such payload."""
        return self.decode(self.data)


class Span(NamedTuple):
    """Messages of one channel in a chunk: class, owner, the file's schema, and where their records begin."""

    kind: type[Message]
    owner: str
    schema: str
    places: list[int]


@dataclass(frozen=True, slots=True)
class RecordedChannel:
    """A channel and how much it holds."""

    noun: str
    owner: str
    count: int


class Recording:
    """A finished recording. Use it as a context manager.

    Args:
        path: An ``.mcap`` file.

    Attributes:
        info: What the recording states about itself.
        channels: By noun, then by owner.
        gaps: What a recovery left out of it.
        start_ns: First log time, 0 if empty.
        stop_ns: Last log time, 0 if empty.

    Raises:
        RecordingError: There is no such file, it is no MCAP file, or it was never finished.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._size = path.stat().st_size
            self._file = path.open("rb")
        except OSError as error:
            raise RecordingError(f"{path} cannot be opened: {error.strerror}") from error
        try:
            self._summary, self.info, self.gaps = self._open()
        except RecordingError:
            self._file.close()
            raise
        statistics = self._summary.statistics
        counts = statistics.channel_message_counts if statistics is not None else {}
        self.start_ns = statistics.message_start_time if statistics is not None else 0
        self.stop_ns = statistics.message_end_time if statistics is not None else 0
        self._known: dict[int, tuple[str, str, str]] = {}
        found = []
        for number, channel in self._summary.channels.items():
            noun, owner = parse_channel(channel.topic)
            schema = self._summary.schemas.get(channel.schema_id)
            if schema is not None and channel.message_encoding == "cdr":
                self._known[number] = noun, owner, schema.data.decode(errors="replace")
                found.append(RecordedChannel(noun, owner, counts.get(number, 0)))
        self.channels = tuple(sorted(found, key=lambda channel: (channel.noun, channel.owner)))

    def missing(self) -> list[str]:
        """What a recovery left out, a sentence for each gap."""
        return [gap.sentence(self.start_ns) for gap in self.gaps]

    def has(self, kind: type[Message], owner: str) -> bool:
        """Whether anything of a class of payloads of this owner was recorded."""
        return any(c.noun == kind.TOPIC.noun and c.owner == owner and c.count for c in self.channels)

    def messages(
        self,
        kinds: Collection[type[Message]],
        owners: Collection[str] | None = None,
        start_ns: int | None = None,
        stop_ns: int | None = None,
    ) -> Iterator[Recorded]:
        """Messages in log order; equal log times in the order of the file.

        Args:
            kinds: Classes of payloads; the file's own schemas say how their bytes are read.
            owners: Only of these vehicles or processes; None for all.
            start_ns: From this log time on.
            stop_ns: Before this log time.

        Raises:
            RecordingError: A chunk of the file is damaged, or a payload of today has a field that the
                file lacks.
        """
        by_noun = {kind.TOPIC.noun: kind for kind in kinds}
        wanted = {
            number: (
                by_noun[noun].TOPIC,
                owner,
                decoder_of(by_noun[noun], schema, f"{self.path}: /{owner}/{noun}"),
            )
            for number, (noun, owner, schema) in self._known.items()
            if noun in by_noun and (owners is None or owner in owners)
        }
        low = 0 if start_ns is None else start_ns
        high = 1 << 64 if stop_ns is None else stop_ns
        chunks = [
            index
            for index in self._summary.chunk_indexes
            if index.message_end_time >= low
            and index.message_start_time < high
            and (not index.message_index_offsets or not wanted.keys().isdisjoint(index.message_index_offsets))
        ]
        chunks.sort(key=lambda index: (index.message_start_time, index.chunk_start_offset))
        pending: list[Recorded] = []
        for position, index in enumerate(chunks):
            found = self._chunk(index, wanted)
            if index.message_start_time < low or index.message_end_time >= high:
                found = [message for message in found if low <= message.log_ns < high]
            pending += found
            pending.sort(key=_log_ns)
            if position + 1 == len(chunks):
                yield from pending
                return
            following_ns = chunks[position + 1].message_start_time
            ready = bisect_left(pending, following_ns, key=_log_ns)
            yield from pending[:ready]
            del pending[:ready]

    def delivered(
        self, kinds: Collection[type[Message]], owners: Collection[str] | None = None
    ) -> Iterator[Delivered]:
        """Decoded messages in log order.

        Raises:
            RecordingError: A payload or a chunk of the file is damaged.
        """
        for message in self.messages(kinds, owners):
            try:
                yield Delivered(message.envelope, message.payload)
            except CodecError as error:
                raise RecordingError(f"{self.path}: {error}") from error

    def spans(self, kinds: Collection[type[Message]]) -> Iterator[tuple[bytes, list[Span]]]:
        """Chunk by chunk the records, and where the messages of each channel of these classes lie in them.

        Raises:
            RecordingError: A chunk of the file is damaged.
        """
        by_noun = {kind.TOPIC.noun: kind for kind in kinds}
        wanted = {
            number: (by_noun[noun], owner, schema)
            for number, (noun, owner, schema) in self._known.items()
            if noun in by_noun
        }
        for index in sorted(self._summary.chunk_indexes, key=attrgetter("message_start_time")):
            data, places = self._chunk_data(index, wanted)
            yield data, [Span(*wanted[number], found) for number, found in places.items()]

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _open(self) -> tuple[Summary, RecordingInfo, tuple[Gap, ...]]:
        try:
            reader = SeekingReader(self._file)
        except _UNREADABLE as error:
            raise RecordingError(f"{self.path} is no MCAP file") from error
        try:
            summary = reader.get_summary()
            metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        except _UNREADABLE as error:
            raise RecordingError(
                f"{self.path} was not finished or is damaged: try `groundstation recording recover`"
            ) from error
        if summary is None:
            raise RecordingError(f"{self.path} has no index: try `groundstation recording recover`")
        try:
            info = RecordingInfo.from_metadata(metadata.get(METADATA_NAME, {"format": str(FORMAT)}))
            return summary, info, from_metadata(metadata.get(GAPS_NAME, {}))
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from error

    def _chunk_data(self, index: ChunkIndex, wanted: Container[int]) -> tuple[bytes, dict[int, list[int]]]:
        """The records of a chunk, and where the messages of channels begin in them."""
        try:
            length = index.chunk_length + index.message_index_length
            if index.chunk_start_offset + length > self._size:
                raise DamagedChunkError("a chunk is said to lie behind the end of the file")
            self._file.seek(index.chunk_start_offset + RECORD.size)
            chunk = read_chunk(self._file.read(index.chunk_length - RECORD.size))
            if chunk is None or not chunk.complete:
                raise DamagedChunkError("a chunk is cut off")
            data = chunk.unpack()
            indexes = self._file.read(index.message_index_length)
            return data, message_places(data, indexes if index.message_index_offsets else b"", wanted)
        except DamagedChunkError as error:
            raise RecordingError(f"{self.path}: {error}: try `groundstation recording recover`") from error

    def _chunk(self, index: ChunkIndex, wanted: dict[int, tuple[Topic, str, Decode]]) -> list[Recorded]:
        data, places = self._chunk_data(index, wanted)
        rows = []
        for place, number in sorted((place, key) for key, found in places.items() for place in found):
            topic, owner, decode = wanted[number]
            start = place + RECORD.size
            stop = start + RECORD.unpack_from(data, place)[1]
            _, sequence, log_ns, publish_ns = MESSAGE.unpack_from(data, start)
            envelope = Envelope(topic, owner, sequence, publish_ns)
            rows.append(Recorded(envelope, data[start + MESSAGE.size : stop], log_ns, decode))
        return rows
