"""Recovery of a recording whose recorder was killed: all that can be read goes into a new, indexed file.

The file is walked from the front. Complete chunks are unpacked; of the chunk at the torn end, the blocks
that its compressor had finished are unpacked too. A damaged chunk is counted and skipped, and so are bytes
that are no record, wherever they lie: behind them the next record is searched, and where the index at the end
is whole, it says where the next chunk begins. Schemas and channels that stood in a damaged chunk are taken
from their copies behind it.
"""

import mmap
import os
import struct
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from groundstation.files.reading import open_file
from groundstation.recording import records
from groundstation.recording.disk_file import check_new_recording
from groundstation.recording.errors import NothingRecoveredError, RecordingError
from groundstation.recording.gaps import GAPS_NAME, Gap, from_metadata, to_metadata
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.records import DamagedChunkError, Opcode
from groundstation.recording.resync import Lost, walk
from groundstation.recording.software import software
from groundstation.recording.summary import summary_of


@dataclass(slots=True)
class Recovery:
    """What was found.

    Attributes:
        messages: Messages brought over.
        torn_bytes: Bytes at the end of the file that are no whole record.
        lost_bytes: Bytes elsewhere that are no record.
        damaged_chunks: Chunks, the torn one included, that could not be unpacked; their messages are lost.
        orphans: Messages lost because the name of their channel stood in a damaged chunk.
        was_finished: The file had been finished properly.
        gaps: Where the damaged chunks stood; the new file states them, those of an earlier recovery included.
        start_ns: Least log time of the new file.
    """

    messages: int = 0
    torn_bytes: int = 0
    lost_bytes: int = 0
    damaged_chunks: int = 0
    orphans: int = 0
    was_finished: bool = False
    gaps: list[Gap] = field(default_factory=list)
    start_ns: int = 0


def recover(source: Path, target: Path) -> Recovery:
    """Write all messages and metadata that are readable in ``source`` into ``target``.

    Args:
        source: A torn recording, usually ``….mcap.part``; it is left as it is.
        target: The new file; it appears only once it is complete.

    Raises:
        NothingRecoveredError: It holds no message that can be read: no file is written.
        RecordingError: The source cannot be read or is no MCAP file, or the target is already there or cannot
            be written.
    """
    check_new_recording(target)
    temporary = target.with_name(f".{os.getpid()}.recovering")
    try:
        file = open_file(source)
    except OSError as error:
        raise RecordingError(f"{source}: {error.strerror}") from error
    try:
        with file, _mapped(file, source) as data, temporary.open("wb") as out:
            recovery = _Copy(data, out, source).run()
        if not recovery.messages:
            lost = f"; the channel of {recovery.orphans} messages is lost" if recovery.orphans else ""
            raise NothingRecoveredError(
                f"{source}: nothing could be recovered, it holds no message that can be read{lost}"
            )
        temporary.replace(target)
    except OSError as error:
        raise RecordingError(f"{target}: {error.strerror}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return recovery


def _mapped(file: BinaryIO, source: Path) -> mmap.mmap:
    if len(file.read(len(records.MAGIC))) < len(records.MAGIC):
        raise RecordingError(f"{source} is no MCAP file, or was torn before its first record")
    return mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)


def _listed_chunks(data: mmap.mmap) -> list[int]:
    """Where the index at the end says that chunks begin; empty where there is none, or it is damaged."""
    try:
        return sorted(chunk.offset for chunk in summary_of(data).chunks)
    except (RecordingError, ValueError, struct.error):
        return []


class _Copy:
    """Carries records over; numbers of schemas and channels are given anew."""

    def __init__(self, data: mmap.mmap, out: BinaryIO, source: Path) -> None:
        self._data = data
        is_mcap = data[: len(records.MAGIC)] == records.MAGIC
        self._chunk_starts = _listed_chunks(data)
        self._pieces = list(walk(data, len(records.MAGIC) if is_mcap else 0, self._chunk_starts))
        self._whole = [piece for piece in self._pieces if isinstance(piece, records.Record)]
        if not (is_mcap or self._whole):
            raise RecordingError(f"{source} is no MCAP file, or was torn before its first record")
        profile = "ros2"
        if self._whole and self._whole[0].opcode == Opcode.HEADER:
            with suppress(ValueError, struct.error):
                profile, _ = records.read_header(data[self._whole[0].start : self._whole[0].stop])
        self._writer = McapFile(out, profile, f"{software()} recover")
        self._found = Recovery()
        self._left_out = 0
        self._ahead: list[records.Record] | None = None  # chunks behind, not looked through for channels yet
        self._metadata: list[tuple[str, dict[str, str]]] = []
        self._newest_ns: int | None = None  # of the chunk before: chunks may stand in any order
        self._is_new_chunk = True
        self._schemas: dict[int, records.Schema] = {}
        self._channels: dict[int, records.Channel] = {}
        self._new_schemas: dict[int, int] = {}
        self._new_channels: dict[int, int] = {}

    def run(self) -> Recovery:
        data, whole = self._data, self._whole
        for record in whole:  # an index at the end, if there is one, names channels of damaged chunks too
            if record.opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
                self._define(record.opcode, data[record.start : record.stop])
        for piece in self._pieces:
            if isinstance(piece, Lost):
                if piece.stop == len(data):
                    self._tail(data[piece.start :])
                else:
                    self._found.lost_bytes += piece.stop - piece.start
                    for _ in range(self._chunks_in(piece)):
                        self._leave_out()
            elif piece.opcode == Opcode.DATA_END:
                break
            else:
                self._take(piece.opcode, data[piece.start : piece.stop])
        self._found.was_finished = data[-len(records.MAGIC) :] == records.MAGIC and len(whole) > 1
        self._close_gap(None)
        if self._found.gaps:
            self._writer.add_metadata(GAPS_NAME, to_metadata(self._found.gaps))
        self._writer.finish()
        return self._found

    def _take(self, opcode: int, content: bytes) -> None:
        if opcode == Opcode.CHUNK:
            try:
                chunk = records.read_chunk(content)
                if chunk is None or not chunk.complete:
                    raise DamagedChunkError("a chunk is shorter than it says")
                self._inside(chunk.unpack())
            except (ValueError, struct.error):
                self._leave_out()
        elif opcode == Opcode.METADATA:
            with suppress(ValueError, struct.error, RecordingError):
                name, entries = records.read_metadata(content)
                if (name, entries) in self._metadata:
                    return  # its second copy
                self._metadata.append((name, entries))
                if name == GAPS_NAME:
                    self._found.gaps += from_metadata(entries)
                else:
                    self._writer.add_metadata(name, entries)
        elif opcode == Opcode.MESSAGE:
            self._message(content)

    def _tail(self, rest: bytes) -> None:
        """The record that was being written when the recorder was killed."""
        self._found.torn_bytes = len(rest)
        if rest[:1] == bytes([Opcode.CHUNK]):
            chunk = records.read_chunk(rest[records.RECORD.size :])
            if chunk is not None:
                try:
                    self._inside(chunk.unpack_what_is_there())
                except (ValueError, struct.error):
                    self._leave_out()

    def _chunks_in(self, lost: Lost) -> int:
        """How many chunks began in what was lost; one where no index tells."""
        if not self._chunk_starts:
            return 1
        return sum(lost.start <= start < lost.stop for start in self._chunk_starts)

    def _leave_out(self) -> None:
        """One more damaged chunk; those without a message between them are one gap."""
        self._found.damaged_chunks += 1
        self._left_out += 1

    def _close_gap(self, before_ns: int | None) -> None:
        if self._left_out:
            after_ns = self._newest_ns
            if after_ns is not None and before_ns is not None:
                after_ns, before_ns = min(after_ns, before_ns), max(after_ns, before_ns)
            self._found.gaps.append(Gap(self._left_out, after_ns, before_ns))
            self._left_out = 0

    def _inside(self, data: bytes) -> None:
        self._is_new_chunk = True
        for opcode, start, stop in records.complete_records(data):
            if opcode == Opcode.MESSAGE:
                self._message(data[start:stop])
            elif opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
                self._define(opcode, data[start:stop])

    def _define(self, opcode: int, content: bytes) -> None:
        with suppress(ValueError, struct.error):  # garbled: its messages are orphans
            if opcode == Opcode.SCHEMA:
                schema = records.read_schema(content)
                self._schemas[schema.number] = schema
            else:
                channel = records.read_channel(content)
                self._channels[channel.number] = channel

    def _message(self, content: bytes) -> None:
        number, sequence, log_ns, publish_ns = records.MESSAGE.unpack_from(content)
        channel = self._new_channels.get(number)
        if channel is None:
            known = self._channels.get(number) or self._look_ahead(number)
            if known is None:
                self._found.orphans += 1
                return
            channel = self._new_channels[number] = self._register(known)
        self._close_gap(log_ns)
        self._found.start_ns = min(log_ns, self._found.start_ns) if self._found.messages else log_ns
        is_newest = self._is_new_chunk or self._newest_ns is None or log_ns > self._newest_ns
        self._newest_ns = log_ns if is_newest else self._newest_ns
        self._is_new_chunk = False
        self._writer.add_message(channel, log_ns, content[records.MESSAGE.size :], publish_ns, sequence)
        self._found.messages += 1

    def _look_ahead(self, number: int) -> records.Channel | None:
        """A channel that no chunk so far names, from its copy behind; each chunk is looked through once."""
        if self._ahead is None:
            self._ahead = [record for record in reversed(self._whole) if record.opcode == Opcode.CHUNK]
        while self._ahead and number not in self._channels:
            record = self._ahead.pop()
            with suppress(ValueError, struct.error):
                chunk = records.read_chunk(self._data[record.start : record.stop])
                inside = b"" if chunk is None else chunk.unpack()
                for opcode, start, stop in records.complete_records(inside):
                    if opcode in {Opcode.SCHEMA, Opcode.CHANNEL}:
                        self._define(opcode, inside[start:stop])
        return self._channels.get(number)

    def _register(self, channel: records.Channel) -> int:
        schema = self._new_schemas.get(channel.schema, 0)
        if schema == 0 and channel.schema in self._schemas:
            known = self._schemas[channel.schema]
            schema = self._writer.add_schema(known.name, known.encoding, known.data)
            self._new_schemas[channel.schema] = schema
        return self._writer.add_channel(channel.topic, channel.encoding, schema)
