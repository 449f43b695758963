"""The recorder: every topic into one MCAP file that viewers and replay can open.

Profile ``ros2``, schemas ``ros2msg``, messages ``cdr``. Messages gather in chunks that are closed after
1 MiB or a quarter of a second, whichever comes first: what a killed recorder can lose is the open chunk,
and the reader recovers the rest. The file is called ``….part`` until it is finished. What the file states
about itself stands in it twice, and its schemas and channels once more every ten seconds: a hole where they
stood first costs no more than its chunk.

Nothing here reads a clock, so that two equal runs in virtual time give equal bytes.
"""

import contextlib
import os
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Self

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.record_stream import Recorded
from groundstation.bus.ros_schema import ENCODING, schema_text
from groundstation.declarations.message import Message
from groundstation.recording.channel_names import channel_name
from groundstation.recording.disk_file import DiskFile, free_bytes, on_disk, open_new
from groundstation.recording.errors import NoRoomError, RecordingError
from groundstation.recording.file_place import finished_name
from groundstation.recording.info import METADATA_NAME, RecordingInfo
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.policy import is_kept
from groundstation.recording.run_files import next_name, part_of
from groundstation.recording.software import software

FLUSH_PERIOD_NS = 250_000_000
SECOND_COPY_NS = 1_000_000_000
"""Of schemas and channels that are new, beside the one in the next chunk."""
REPEAT_NS = 10_000_000_000
MOST_RECENT = 256
"""Messages per topic among which one that comes again is looked for."""


@dataclass(slots=True)
class _Stream:
    """What is known of one topic of one owner in the record stream.

    Attributes:
        is_latched: Whether late joiners receive its last message again.
        channel: Of the file; None where the policy drops it.
        newest: Moment and number of the newest message, which need not have come last: who testifies for a
            process that died has not received all that it published.
        recent: Of the messages that came last.
    """

    is_latched: bool
    channel: int | None
    newest: tuple[int, int] = (-1, -1)
    recent: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=MOST_RECENT))


class Recorder:
    """Writes one recording. Use it as a context manager, from one thread.

    Attributes:
        path: Of the finished file.
        part_path: Of the file until then; both follow a file that is moved.
        message_count: Messages written or in the open chunk.
        latched: The newest latched messages of the record stream, by noun and owner: a file that goes on from
            here begins with them.

    Args:
        path: The finished file, e.g. ``run.mcap``; until then it is ``run.mcap.part``.
        info: What the recording states about itself.
        flush_period_ns: At most this much of log time is lost when the recorder is killed.
        durable: Also force each flush through to the disk, against loss of power.
        spare_bytes: Raise while so many bytes are left beside what finishing takes; 0: when none are.
        begins_ns: Latched messages of the record stream that are older have this log time.

    Raises:
        RecordingError: The file, or what a killed recorder left of it, is already there, or it
            cannot be written.
    """

    def __init__(
        self,
        path: Path,
        info: RecordingInfo,
        *,
        flush_period_ns: int = FLUSH_PERIOD_NS,
        durable: bool = False,
        spare_bytes: int = 0,
        begins_ns: int = 0,
    ) -> None:
        self.path = path
        self.part_path = part_of(path)
        self.message_count = 0
        self._images = info.images
        self._flush_period_ns = flush_period_ns
        self._durable = durable
        self._spare_bytes = spare_bytes
        self._begins_ns = begins_ns
        self._flush_due_ns: int | None = None
        self._channels: dict[tuple[type[Message], str], int | None] = {}  # by class and owner
        self._encoders: dict[type[Message], Callable[[Message], bytes]] = {}
        self._schemas: dict[str, int] = {}
        self._streams: dict[tuple[str, str], _Stream] = {}  # by noun and owner
        self.latched: dict[tuple[str, str], Recorded] = {}
        self._newest_ns = 0
        self._has_new_channels = False
        self._repeat_due_ns = 0
        self._stated: dict[str, str] | None = info.to_metadata()
        """What the file states about itself, until the second copy is written."""
        self._has_index = False
        self._file: DiskFile | None = open_new(path)
        try:
            self._writer = McapFile(self._file, profile="ros2", library=software())
            self._writer.add_metadata(METADATA_NAME, self._stated)
        except RecordingError:
            self.discard()  # nothing is in it that could be recovered
            raise

    @property
    def written_bytes(self) -> int:
        """In the file so far; the open chunk is not."""
        return 0 if self._file is None else self._file.tell()

    @property
    def rest_bytes(self) -> int:
        """At most so many bytes are still to be written if the recording is finished now."""
        if self._file is None:
            return 0
        stated = self._stated or {}
        return self._writer.rest_bytes + sum(len(f"{key}{text}".encode()) + 8 for key, text in stated.items())

    @property
    def free_bytes(self) -> int:
        """On the disk of the file.

        Raises:
            RecordingError: It is gone.
        """
        return free_bytes(self.path) if self._file is None else self._file.free_bytes()

    def check_place(self) -> bool:
        """Look where the file is, by two system calls; return whether it was moved since.

        Raises:
            LostFileError: It was deleted, or no path leads to it any more.
            RecordingError: Its disk is gone.
        """
        if self._file is None:
            return False
        place = self._file.place(self.part_path)
        if place == self.part_path:
            return False
        self.part_path, self.path = place, finished_name(place)
        return True

    def record(self, delivered: Delivered, now_ns: int) -> None:
        """Write one message.

        Args:
            delivered: The payload with its envelope.
            now_ns: Log time: arrival at the recorder live, moment of publication in lockstep.
        """
        envelope, payload = delivered
        kind = type(payload)
        channel = self._channel(kind, envelope.owner)
        if channel is not None:
            encode = self._encoders.get(kind)
            if encode is None:
                encode = self._encoders[kind] = codec_of(kind).encode
            self._add(channel, envelope.sequence, envelope.publish_ns, encode(payload), now_ns)

    def record_encoded(self, kind: type[Message], envelope: Envelope, data: bytes, log_ns: int) -> None:
        """Write one message whose payload is already in CDR."""
        channel = self._channel(kind, envelope.owner)
        if channel is not None:
            self._add(channel, envelope.sequence, envelope.publish_ns, data, log_ns)

    def record_batch(self, messages: Iterable[Recorded], payloads: Mapping[str, type[Message]]) -> int:
        """Write messages of the record stream; their log time is that of their publication.

        A message that comes again is written once: latched ones are repeated for late joiners, and of a
        process that died the others record what they received.

        Args:
            messages: Of a batch.
            payloads: Payload classes by noun.

        Returns:
            How many were none of these and are not written.
        """
        unknown = 0
        streams, add = self._streams, self._add
        for message in messages:
            noun, owner, sequence, publish_ns = message[:4]
            stream = streams.get((noun, owner))
            if stream is None:
                kind = payloads.get(noun)
                if kind is None:
                    unknown += 1
                    continue
                stream = streams[noun, owner] = _Stream(kind.TOPIC.latched, self._channel(kind, owner))
            place = publish_ns, sequence
            is_newest = place > stream.newest
            if is_newest:
                stream.newest = place
            elif place in stream.recent:
                continue
            stream.recent.append(place)
            log_ns = publish_ns
            if stream.is_latched:
                if is_newest:
                    self.latched[noun, owner] = message
                log_ns = max(publish_ns, self._begins_ns)
            if stream.channel is not None:
                add(stream.channel, sequence, publish_ns, message.data, log_ns)
        return unknown

    def tick(self, now_ns: int) -> None:
        """Time passed without a message: close the chunk if it is due. The clock is that of the log times."""
        if self._flush_due_ns is not None and now_ns >= self._flush_due_ns:
            self._flush()

    def finish(self) -> Path:
        """Write the index and give the file its final name, wherever it is by now; may be called again.

        Returns:
            Where it is.

        Raises:
            LostFileError: It was deleted; or it is complete, but no path leads to it any more.
            RecordingError: The disk is full, or gone.
        """
        if self._file is not None:
            if not self._has_index:
                self._writer.flush()
                self._state_again()
                self._writer.finish()
                self._has_index = True
            with on_disk(self.part_path):
                os.fsync(self._file.fileno())
            self.check_place()
            with on_disk(self.part_path):
                if self.path != self.part_path:
                    if self.path.exists():  # it was not when this recording began
                        self.path = next_name(self.path)
                    self.part_path.rename(self.path)
                self._file.close()
            self._file = None
        return self.path

    @property
    def is_whole(self) -> bool:
        """Whether the index is written: with it the file can be read under any name."""
        return self._has_index

    def end_early(self) -> int:
        """Finish without what a full disk has not taken; return how many messages that costs.

        A recording in which there is no message leaves no file.

        Raises:
            RecordingError: Not even the index finds room; it may be tried again.
        """
        dropped = self._writer.drop_open_chunk()
        self.message_count -= dropped
        self._stated = None  # room for the index is what matters
        if self.message_count:
            self.finish()
        else:
            self.discard()
        return dropped

    def discard(self) -> None:
        """Leave no file: for derived recordings whose making failed; does nothing after ``finish``."""
        if self._file is not None:
            with contextlib.suppress(RecordingError):  # it is gone already
                self.check_place()
                with on_disk(self.part_path):
                    self.part_path.unlink()
            with contextlib.suppress(RecordingError), on_disk(self.part_path):
                self._file.close()
            self._file = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.finish()

    def _add(self, channel: int, sequence: int, publish_ns: int, data: bytes, log_ns: int) -> None:
        self._writer.add_message(channel, log_ns, data, publish_ns, sequence)
        self.message_count += 1
        if log_ns > self._newest_ns:
            self._newest_ns = log_ns
        if self._flush_due_ns is None:
            self._flush_due_ns = log_ns + self._flush_period_ns
        elif log_ns >= self._flush_due_ns:
            self._flush()

    def check_room(self, free: int) -> None:
        """End in time: the index that makes it a finished recording needs room, too.

        Raises:
            NoRoomError: The disk has less free bytes than that takes; what was written so far is whole.
        """
        if free < self.rest_bytes + self._spare_bytes:
            raise NoRoomError(f"{self.part_path} cannot be written any further: the disk is full")

    def _flush(self) -> None:
        self._flush_due_ns = None
        if self._spare_bytes:
            self.check_room(self.free_bytes)
        self._writer.flush()
        if self._has_new_channels or self._newest_ns >= self._repeat_due_ns:
            wait_ns = SECOND_COPY_NS if self._has_new_channels else REPEAT_NS
            self._repeat_due_ns = self._newest_ns + wait_ns
            if not self._has_new_channels:
                self._state_again()
            self._has_new_channels = False
            self._writer.repeat_definitions()
        if self._durable and self._file is not None:
            with on_disk(self.part_path):
                os.fsync(self._file.fileno())

    def _state_again(self) -> None:
        """Write the second copy of what the file states about itself, once, far behind the first."""
        if self._stated is not None:
            stated, self._stated = self._stated, None
            self._writer.add_metadata(METADATA_NAME, stated)

    def _channel(self, kind: type[Message], owner: str) -> int | None:
        """Channel of a topic of an owner, registered at first use; None if the policy drops it."""
        key = (kind, owner)
        try:
            return self._channels[key]
        except KeyError:
            pass
        channel = self._register(kind, owner) if is_kept(kind.TOPIC, self._images) else None
        self._channels[key] = channel
        return channel

    def _register(self, kind: type[Message], owner: str) -> int:
        self._has_new_channels = True
        noun = kind.TOPIC.noun
        schema = self._schemas.get(noun)
        if schema is None:
            text = schema_text(kind).encode()
            schema = self._schemas[noun] = self._writer.add_schema(kind.ROS_TYPE, ENCODING, text)
        return self._writer.add_channel(channel_name(noun, owner), "cdr", schema)
