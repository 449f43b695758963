"""The recorder: every topic of the table into one MCAP file that viewers and replay can open.

Profile ``ros2``, schemas ``ros2msg``, messages ``cdr``. Messages gather in chunks that are closed after
1 MiB or a quarter of a second, whichever comes first: what a killed recorder can lose is the open chunk,
and the reader recovers the rest. The file is called ``….part`` until it is finished.

Nothing here reads a clock, so that two equal runs in virtual time give equal bytes.
"""

import os
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

from mcap.writer import CompressionType, Writer

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.topics import Topic
from groundstation.messages.ros_schema import ENCODING, schema_text
from groundstation.recording.channels import channel_name
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import METADATA_NAME, RecordingInfo
from groundstation.recording.policy import is_kept
from groundstation.recording.software import software

PART_SUFFIX = ".part"
CHUNK_BYTES = 1 << 20
FLUSH_PERIOD_NS = 250_000_000


class Recorder:
    """Writes one recording. Use it as a context manager, from one thread.

    Args:
        path: The finished file, e.g. ``run.mcap``; until then it is ``run.mcap.part``.
        info: What the recording says about itself.
        flush_period_ns: At most this much of log time is lost when the recorder is killed.
        durable: Also force each flush through to the disk, against loss of power.

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
    ) -> None:
        self.path = path
        self.part_path = path.with_name(path.name + PART_SUFFIX)
        self.message_count = 0
        self._images = info.images
        self._flush_period_ns = flush_period_ns
        self._durable = durable
        self._flush_due_ns: int | None = None
        self._channels: dict[tuple[int, str], int | None] = {}  # by topic row and owner
        self._schemas: dict[int, int] = {}
        self._file: BinaryIO | None = _open_new(path, self.part_path)
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=software())
        self._writer.add_metadata(METADATA_NAME, info.to_metadata())
        self._file.flush()

    def record(self, delivered: Delivered, now_ns: int) -> None:
        """Write one message.

        Args:
            delivered: The payload with its envelope.
            now_ns: Log time: arrival at the recorder live, moment of publication in lockstep.
        """
        envelope = delivered.envelope
        channel = self._channel(envelope.topic, envelope.vehicle)
        if channel is not None:
            self._add(channel, envelope, envelope.topic.codec.encode(delivered.payload), now_ns)

    def record_encoded(self, envelope: Envelope, data: bytes, log_ns: int) -> None:
        """Write one message whose payload is already in CDR, as it came from the bus."""
        channel = self._channel(envelope.topic, envelope.vehicle)
        if channel is not None:
            self._add(channel, envelope, data, log_ns)

    def tick(self, now_ns: int) -> None:
        """Time passed without a message: close the chunk if it is due. The clock is that of the log times."""
        if self._flush_due_ns is not None and now_ns >= self._flush_due_ns:
            self._flush()

    def finish(self) -> Path:
        """Write the index and give the file its final name; may be called twice."""
        if self._file is not None:
            self._writer.finish()  # type: ignore[no-untyped-call]  # unannotated in mcap
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
            self._file = None
            self.part_path.replace(self.path)
        return self.path

    def discard(self) -> None:
        """Leave no file: for derived recordings whose making failed; does nothing after ``finish``."""
        if self._file is not None:
            self._file.close()
            self._file = None
            self.part_path.unlink()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.finish()

    def _add(self, channel: int, envelope: Envelope, data: bytes, log_ns: int) -> None:
        self._writer.add_message(
            channel, log_time=log_ns, data=data, publish_time=envelope.publish_ns, sequence=envelope.sequence
        )
        self.message_count += 1
        if self._flush_due_ns is None:
            self._flush_due_ns = log_ns + self._flush_period_ns
        elif log_ns >= self._flush_due_ns:
            self._flush()

    def _flush(self) -> None:
        self._flush_due_ns = None
        self._writer.flush()  # type: ignore[no-untyped-call]  # unannotated in mcap
        if self._durable and self._file is not None:
            os.fsync(self._file.fileno())

    def _channel(self, topic: Topic, owner: str) -> int | None:
        """Channel of a topic of an owner, registered at first use; None if the policy drops it."""
        key = (topic.index, owner)
        try:
            return self._channels[key]
        except KeyError:
            pass
        channel = self._register(topic, owner) if is_kept(topic, self._images) else None
        self._channels[key] = channel
        return channel

    def _register(self, topic: Topic, owner: str) -> int:
        schema = self._schemas.get(topic.index)
        if schema is None:
            text = schema_text(topic.payload).encode()
            schema = self._schemas[topic.index] = self._writer.register_schema(
                topic.payload.ROS_TYPE, ENCODING, text
            )
        return self._writer.register_channel(channel_name(topic, owner), "cdr", schema)


def _open_new(path: Path, part_path: Path) -> BinaryIO:
    if path.exists():
        raise RecordingError(f"{path} is already there: recordings are never overwritten")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if part_path.exists():
            raise RecordingError(
                f"{part_path} is left of a recording that was not finished: recover it or remove it first"
            )
        return part_path.open("xb")
    except OSError as error:
        raise RecordingError(f"{part_path} cannot be written: {error.strerror}") from error
