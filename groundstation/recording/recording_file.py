"""One finished file of a recording: its index, its channels, its chunks one at a time."""

import mmap
import os
import struct
from collections.abc import Container
from pathlib import Path
from typing import NamedTuple

from groundstation.files.reading import open_file
from groundstation.recording import records
from groundstation.recording.channel_names import parse_channel
from groundstation.recording.errors import RecordingError
from groundstation.recording.gaps import GAPS_NAME, Gap, from_metadata
from groundstation.recording.info import FORMAT, METADATA_NAME, RecordingInfo
from groundstation.recording.records import MAGIC, RECORD, DamagedChunkError
from groundstation.recording.resync import holds_messages
from groundstation.recording.summary import ListedChunk, UnfinishedError, read_summary

_RECOVER = "try `groundstation recording recover`"
_LOOKED_THROUGH = 1 << 26
"""Bytes of a file that cannot be opened, for what a recovery would find."""
_UNREADABLE = (struct.error, ValueError, OverflowError, OSError)


class KnownChannel(NamedTuple):
    """A channel that may hold payloads of this program.

    Attributes:
        noun: Of its topic.
        owner: Vehicle or process, empty for the rig.
        schema_name: Of the file's own schema, such as ``air_table_msgs/msg/VehicleState``.
        schema: Its text.
        messages: In this file.
    """

    noun: str
    owner: str
    schema_name: str
    schema: str
    messages: int


class RecordingFile:
    """A finished file; it may be read from several threads.

    Args:
        path: An ``.mcap`` file.

    Attributes:
        path: Of the file.
        info: What it states about itself.
        gaps: What a recovery left out of it.
        summary: Its index.
        channels: In CDR and with a schema, by number.

    Raises:
        RecordingError: There is no such file, it is no MCAP file, or it was never finished.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self.size = path.stat().st_size
            self._file = open_file(path)
        except OSError as error:
            raise RecordingError(f"{path} cannot be opened: {error.strerror}") from error
        try:
            self._open()
        except BaseException:
            self._file.close()
            raise

    def chunk(self, listed: ListedChunk, wanted: Container[int]) -> tuple[bytes, dict[int, list[int]]]:
        """The records of a chunk, and where the messages of channels begin in them.

        Raises:
            RecordingError: The chunk is damaged.
        """
        data, indexes = self._read(listed)
        return data, records.message_places(data, indexes if listed.entries else b"", wanted)

    def unpacked(self, listed: ListedChunk) -> bytes:
        """The records of a chunk.

        Raises:
            RecordingError: The chunk is damaged.
        """
        return self._read(listed)[0]

    def _read(self, listed: ListedChunk) -> tuple[bytes, bytes]:
        """The records of a chunk, and the indexes of its channels."""
        try:
            length = listed.length + listed.index_length
            if listed.offset + length > self.size:
                raise DamagedChunkError("a chunk is said to lie behind the end of the file")
            found = os.pread(self._file.fileno(), length, listed.offset)
            chunk = records.read_chunk(found[RECORD.size : listed.length])
            if chunk is None or not chunk.complete:
                raise DamagedChunkError("a chunk is cut off")
            return chunk.unpack(), found[listed.length :]
        except DamagedChunkError as error:
            raise RecordingError(f"{self.path}: {error}: {_RECOVER}") from error

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _open(self) -> None:
        try:
            if os.pread(self._file.fileno(), len(MAGIC), 0) != MAGIC:
                if self._may_be_recovered():
                    raise RecordingError(f"{self.path} is damaged at its beginning: {_RECOVER}")
                raise RecordingError(f"{self.path} is no MCAP file")
            self.summary = read_summary(self._file.fileno(), self.size)
            metadata = dict(self._metadata(*place) for place in self.summary.metadata_places)
            schemas = {
                number: found.data.decode(errors="replace") for number, found in self.summary.schemas.items()
            }
        except UnfinishedError as error:
            raise RecordingError(f"{self.path} {error}: {self._way_out()}") from error
        except _UNREADABLE as error:
            raise RecordingError(f"{self.path} was not finished or is damaged: {self._way_out()}") from error
        try:
            self.info = RecordingInfo.from_metadata(metadata.get(METADATA_NAME, {"format": str(FORMAT)}))
            self.gaps: tuple[Gap, ...] = from_metadata(metadata.get(GAPS_NAME, {}))
        except RecordingError as error:
            raise RecordingError(f"{self.path}: {error}") from error
        counts = self.summary.statistics.counts
        self.channels = {
            number: KnownChannel(
                *parse_channel(channel.topic),
                self.summary.schemas[channel.schema].name,
                schemas[channel.schema],
                counts.get(number, 0),
            )
            for number, channel in self.summary.channels.items()
            if channel.schema in schemas and channel.encoding == "cdr"
        }

    def _way_out(self) -> str:
        return _RECOVER if self._may_be_recovered() else "nothing in it can be recovered"

    def _may_be_recovered(self) -> bool:
        """Whether a recovery would find something; of a very long file only the beginning is searched."""
        try:
            length = min(self.size, _LOOKED_THROUGH)
            with mmap.mmap(self._file.fileno(), length, access=mmap.ACCESS_READ) as data:
                return holds_messages(data) or (length < self.size and data[: len(MAGIC)] == MAGIC)
        except (OSError, ValueError):  # an empty file
            return False

    def _metadata(self, offset: int, length: int) -> tuple[str, dict[str, str]]:
        """A metadata record; where a hole has hit it, another copy of it may stand elsewhere."""
        record = os.pread(self._file.fileno(), length, offset)
        try:
            return records.read_metadata(record[RECORD.size :])
        except (struct.error, ValueError):
            return "", {}
