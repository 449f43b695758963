"""A stretch of a recording as a recording of its own."""

import os
from collections.abc import Callable, Collection
from pathlib import Path
from typing import BinaryIO

from groundstation.bus.envelope import Envelope
from groundstation.bus.ros_schema import ENCODING
from groundstation.declarations.message import Message
from groundstation.recording import records
from groundstation.recording.channel_names import channel_name
from groundstation.recording.disk_file import check_new_recording
from groundstation.recording.errors import RecordingError
from groundstation.recording.gaps import GAPS_NAME, to_metadata
from groundstation.recording.info import METADATA_NAME
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.reader import Recorded, Recording
from groundstation.recording.recording_file import KnownChannel, RecordingFile
from groundstation.recording.run_files import files_of
from groundstation.recording.software import software

Progress = Callable[[str, float], None]
CUT_NAME = "groundstation.cut"
"""Metadata record of a cut: what it was cut from, and where."""


def cut(
    source: Path,
    target: Path,
    span_s: tuple[float, float | None],
    latched: Collection[type[Message]],
    progress: Progress,
) -> int:
    """Write what was logged in a stretch of time; what was latched before stands at its beginning.

    Log times, stamps and sequence numbers stay, and so do schemas of others.

    Args:
        source: An ``.mcap`` file, or the folder of a run.
        target: The new file; it appears only once it is complete.
        span_s: From and to, in seconds since the recording began; None for the end.
        latched: Payload classes of topics whose newest value is known to late joiners.
        progress: Takes what is being done, and the share that is done.

    Returns:
        How many messages are in it.

    Raises:
        RecordingError: The source cannot be read, the stretch holds nothing, or the target cannot be written.
    """
    check_new_recording(target)
    with Recording(source) as recording:
        low_ns, high_ns = _stretch(recording, *span_s)
        before = recording.newest(latched, low_ns - 1)
        channels = {(c.noun, c.owner): c for c in recording.known_channels()}
        stated = {METADATA_NAME: recording.info.to_metadata()}
        if recording.gaps:
            stated[GAPS_NAME] = to_metadata(recording.gaps)
        stated[CUT_NAME] = {
            "of": source.name,
            "from_s": f"{span_s[0]:.9g}",
            "to_s": f"{(high_ns - recording.start_ns) * 1e-9:.9g}",
        }
    target.parent.mkdir(parents=True, exist_ok=True)
    temporary = target.with_name(f".{os.getpid()}.cutting")
    try:
        with temporary.open("wb") as out:
            cutting = _Cut(out, stated)
            for message in before:
                cutting.carry(channels[message.envelope.topic.noun, message.envelope.owner], message, low_ns)
            for path in files_of(source):
                cutting.take(path, low_ns, high_ns, progress)
            cutting.writer.finish()
        temporary.replace(target)
    except OSError as error:
        raise RecordingError(f"{error.filename or target}: {error.strerror}") from error
    finally:
        temporary.unlink(missing_ok=True)
    return cutting.count


def _stretch(recording: Recording, from_s: float, to_s: float | None) -> tuple[int, int]:
    """First log time of a stretch, and the one before which it ends; whatever numbers are given."""
    start_ns, end_ns = recording.start_ns, recording.stop_ns + 1
    duration_s = (recording.stop_ns - start_ns) * 1e-9
    if 0.0 <= from_s <= duration_s and (to_s is None or from_s < to_s):
        low_ns = start_ns + round(from_s * 1e9)
        high_ns = end_ns if to_s is None or to_s > duration_s else start_ns + round(to_s * 1e9)
        if low_ns < min(high_ns, end_ns):
            return low_ns, high_ns
    end = "its end" if to_s is None else f"{to_s:g} s"
    raise RecordingError(
        f"{recording.path} is {duration_s:.1f} s long: there is nothing from {from_s:g} s to {end}"
    )


class _Cut:
    """The new file; schemas and channels get numbers of its own."""

    def __init__(self, out: BinaryIO, stated: dict[str, dict[str, str]]) -> None:
        self.writer = McapFile(out, "ros2", software())
        self.count = 0
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int], int] = {}
        self._carried: set[tuple[str, int, int]] = set()
        for name, entries in stated.items():
            self.writer.add_metadata(name, entries)

    def carry(self, channel: KnownChannel, message: Recorded, log_ns: int) -> None:
        """Begin with a message of before; its moment of publication stays."""
        envelope: Envelope = message.envelope
        topic = channel_name(channel.noun, channel.owner)
        number = self._channel(topic, "cdr", (channel.schema_name, ENCODING, channel.schema.encode()))
        self.writer.add_message(number, log_ns, message.data, envelope.publish_ns, envelope.sequence)
        self._carried.add((topic, envelope.publish_ns, envelope.sequence))
        self.count += 1

    def take(self, path: Path, low_ns: int, high_ns: int, progress: Progress) -> None:
        """Copy the messages of a file whose log times lie in the stretch."""
        file = RecordingFile(path)
        try:
            listed = [c for c in file.summary.chunks if c.stop_ns >= low_ns and c.start_ns < high_ns]
            numbers = {number: self._number(file, number) for number in file.summary.channels}
            for done, chunk in enumerate(listed):
                progress(f"cutting {path.name}", done / len(listed))
                self._copy(file.unpacked(chunk), numbers, low_ns, high_ns)
                self.writer.flush()
        finally:
            file.close()

    def _copy(self, data: bytes, numbers: dict[int, tuple[str, int]], low_ns: int, high_ns: int) -> None:
        for opcode, start, stop in records.complete_records(data):
            if opcode != records.Opcode.MESSAGE:
                continue
            channel, sequence, log_ns, publish_ns = records.MESSAGE.unpack_from(data, start)
            if not low_ns <= log_ns < high_ns or channel not in numbers:
                continue
            topic, number = numbers[channel]
            if (topic, publish_ns, sequence) in self._carried:
                continue
            self.writer.add_message(
                number, log_ns, data[start + records.MESSAGE.size : stop], publish_ns, sequence
            )
            self.count += 1

    def _number(self, file: RecordingFile, number: int) -> tuple[str, int]:
        channel = file.summary.channels[number]
        schema = file.summary.schemas.get(channel.schema)
        key = None if schema is None else (schema.name, schema.encoding, schema.data)
        return channel.topic, self._channel(channel.topic, channel.encoding, key)

    def _channel(self, topic: str, encoding: str, schema: tuple[str, str, bytes] | None) -> int:
        of_schema = 0
        if schema is not None:
            if schema not in self._schemas:
                self._schemas[schema] = self.writer.add_schema(*schema)
            of_schema = self._schemas[schema]
        key = topic, encoding, of_schema
        if key not in self._channels:
            self._channels[key] = self.writer.add_channel(topic, encoding, of_schema)
        return self._channels[key]
