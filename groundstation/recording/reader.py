"""Reads finished recordings lazily, in the order of their log times.

The index at the end of a file states which chunks hold which channels; chunks are unpacked one at a time, so
that a recording of any length is read in little memory, and from any moment on at once.
"""

from bisect import bisect_left
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from types import TracebackType
from typing import NamedTuple, Self

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.declarations.message import Message
from groundstation.declarations.topic import Topic
from groundstation.recording.gaps import Gap
from groundstation.recording.recording_file import KnownChannel, RecordingFile
from groundstation.recording.records import MESSAGE, RECORD
from groundstation.recording.run_files import FIRST_NAME, files_of, run_of
from groundstation.recording.schemas import Decode, decoder_of
from groundstation.recording.summary import ListedChunk

_log_ns = attrgetter("log_ns")
_ALWAYS_NS = 1 << 64


class Recorded(NamedTuple):
    """One recorded message, not yet decoded; a named tuple, since a recording holds millions.

    Attributes:
        envelope: Topic, owner, sequence and moment of publication. Wall time and causes are in the journal
            (``CauseIndex``).
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
        """The payload, decoded anew at each call; RecordingError if the bytes are no such payload."""
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


_Wanted = dict[int, tuple[Topic, str, Decode]]


class Recording:
    """A finished recording. Use it as a context manager.

    Args:
        path: An ``.mcap`` file, or the folder of a run: all files that its recorder has left are read as one.

    Attributes:
        path: As it was given.
        files: That are read, in the order of their beginnings.
        info: What the recording states about itself, in its first file.
        channels: By noun, then by owner.
        gaps: What a recovery left out of it.
        start_ns: First log time, 0 if empty.
        stop_ns: Last log time, 0 if empty.

    Raises:
        RecordingError: There is no such file, it is no MCAP file, or it was never finished.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._files: list[RecordingFile] = []
        try:
            for each in files_of(path):
                self._files.append(RecordingFile(each))
        except BaseException:
            self.close()
            raise
        self._files.sort(key=lambda file: file.summary.statistics.start_ns)
        self.files = tuple(file.path for file in self._files)
        self.info = self._files[0].info
        self.gaps: tuple[Gap, ...] = tuple(gap for file in self._files for gap in file.gaps)
        statistics = [file.summary.statistics for file in self._files if file.summary.chunks]
        self.start_ns = min((found.start_ns for found in statistics), default=0)
        self.stop_ns = max((found.stop_ns for found in statistics), default=0)
        counts: dict[tuple[str, str], int] = {}
        for file in self._files:
            for channel in file.channels.values():
                name = channel.noun, channel.owner
                counts[name] = counts.get(name, 0) + channel.messages
        self.channels = tuple(RecordedChannel(*name, counts[name]) for name in sorted(counts))

    def missing(self) -> list[str]:
        """What is not there: what a recovery left out, and files of the run that were not finished."""
        torn = run_of(self.path / FIRST_NAME)[1] if self.path.is_dir() else []
        unread = [
            f"{path} was not finished and is not read: `groundstation recording recover`"
            for path in torn
            if path.with_suffix("") not in self.files  # it has been recovered
        ]
        return [gap.sentence(self.start_ns) for gap in self.gaps] + unread

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

        Only the chunks of the stretch that is asked for are read: any moment of an hour's recording is there
        within milliseconds.

        Args:
            kinds: Classes of payloads; the file's own schemas say how their bytes are read.
            owners: Only of these vehicles or processes; None for all.
            start_ns: From this log time on.
            stop_ns: Before this log time.

        Raises:
            RecordingError: A chunk of the file is damaged, or a payload of today has a field that the
                file lacks.
        """
        low = 0 if start_ns is None else start_ns
        high = _ALWAYS_NS if stop_ns is None else stop_ns
        chunks: list[tuple[int, int, ListedChunk, RecordingFile, _Wanted]] = []
        for number, file in enumerate(self._files):
            wanted = self._wanted(file, kinds, owners)
            places = file.summary.chunks_with(wanted, low, high)
            chunks += (
                (file.summary.chunks[at].start_ns, number, file.summary.chunks[at], file, wanted)
                for at in places
            )
        chunks.sort(key=lambda chunk: chunk[:2])
        once = _Once() if len(self._files) > 1 else None
        pending: list[Recorded] = []
        for position, (_, _, listed, file, wanted) in enumerate(chunks):
            found = _rows(file, listed, wanted)
            if listed.start_ns < low or listed.stop_ns >= high:
                found = [message for message in found if low <= message.log_ns < high]
            pending += found if once is None else filter(once, found)
            pending.sort(key=_log_ns)
            if position + 1 == len(chunks):
                yield from pending
                return
            following_ns = chunks[position + 1][0]
            ready = bisect_left(pending, following_ns, key=_log_ns)
            yield from pending[:ready]
            del pending[:ready]

    def newest(
        self, kinds: Collection[type[Message]], at_ns: int, owners: Collection[str] | None = None
    ) -> list[Recorded]:
        """The newest message of each channel at a moment: what was known then, in log order.

        Args:
            kinds: Classes of payloads.
            at_ns: Log time; messages of this very time count.
            owners: Only of these vehicles or processes; None for all.

        Raises:
            RecordingError: As ``messages``.
        """
        found: dict[tuple[str, str], Recorded] = {}
        for file in reversed(self._files):
            wanted = self._wanted(file, kinds, owners)
            names = {number: (topic.noun, owner) for number, (topic, owner, _) in wanted.items()}
            left = {n: file.summary.last_chunks(n, at_ns) for n, name in names.items() if name not in found}
            while left:
                chunks: dict[int, _Wanted] = {}
                for number, places in list(left.items()):
                    place = next(places, None)
                    if place is None:
                        del left[number]
                    else:
                        chunks.setdefault(place, {})[number] = wanted[number]
                for place in sorted(chunks):
                    for message in _rows(file, file.summary.chunks[place], chunks[place]):
                        if message.log_ns <= at_ns:
                            found[message.envelope.topic.noun, message.envelope.owner] = message
                left = {number: places for number, places in left.items() if names[number] not in found}
        return sorted(found.values(), key=_log_ns)

    def delivered(
        self, kinds: Collection[type[Message]], owners: Collection[str] | None = None
    ) -> Iterator[Delivered]:
        """Decoded messages in log order.

        Raises:
            RecordingError: A payload or a chunk of the file is damaged.
        """
        for message in self.messages(kinds, owners):
            yield Delivered(message.envelope, message.payload)

    def spans(
        self, kinds: Collection[type[Message]], owners: Collection[str] | None = None
    ) -> Iterator[tuple[bytes, list[Span]]]:
        """Chunk by chunk the records, and where the messages of each channel of these classes lie in them.

        Args:
            kinds: Classes of payloads.
            owners: Only of these vehicles or processes; None for all.

        Raises:
            RecordingError: A chunk of the file is damaged.
        """
        by_noun = {kind.TOPIC.noun: kind for kind in kinds}
        for file in self._files:
            wanted = {
                number: channel
                for number, channel in file.channels.items()
                if channel.noun in by_noun and (owners is None or channel.owner in owners)
            }
            for at in file.summary.chunks_with(wanted):
                data, places = file.chunk(file.summary.chunks[at], wanted)
                yield (
                    data,
                    [
                        Span(by_noun[wanted[number].noun], wanted[number].owner, wanted[number].schema, found)
                        for number, found in places.items()
                    ],
                )

    def known_channels(self) -> list[KnownChannel]:
        """Every channel of every file, with its own schema."""
        return [channel for file in self._files for channel in file.channels.values()]

    def close(self) -> None:
        """Close the files."""
        for file in self._files:
            file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @staticmethod
    def _wanted(
        file: RecordingFile, kinds: Collection[type[Message]], owners: Collection[str] | None
    ) -> _Wanted:
        """By the numbers of a file: topic, owner and decoder of its channels."""
        by_noun = {kind.TOPIC.noun: kind for kind in kinds}
        return {
            number: (
                by_noun[channel.noun].TOPIC,
                channel.owner,
                decoder_of(
                    by_noun[channel.noun], channel.schema, f"{file.path}: /{channel.owner}/{channel.noun}"
                ),
            )
            for number, channel in file.channels.items()
            if channel.noun in by_noun and (owners is None or channel.owner in owners)
        }


class _Once:
    """Passes each latched message once: a file that goes on repeats what was latched before it."""

    def __init__(self) -> None:
        self._newest: dict[tuple[str, str], tuple[int, int]] = {}

    def __call__(self, message: Recorded) -> bool:
        envelope = message.envelope
        if not envelope.topic.latched:
            return True
        name, this = (envelope.topic.noun, envelope.owner), (envelope.publish_ns, envelope.sequence)
        if self._newest.get(name) == this:
            return False
        self._newest[name] = this
        return True


def _rows(file: RecordingFile, listed: ListedChunk, wanted: _Wanted) -> list[Recorded]:
    data, places = file.chunk(listed, wanted)
    rows = []
    for place, number in sorted((place, key) for key, found in places.items() for place in found):
        topic, owner, decode = wanted[number]
        start = place + RECORD.size
        stop = start + RECORD.unpack_from(data, place)[1]
        _, sequence, log_ns, publish_ns = MESSAGE.unpack_from(data, start)
        envelope = Envelope(topic, owner, sequence, publish_ns)
        rows.append(Recorded(envelope, data[start + MESSAGE.size : stop], log_ns, decode))
    return rows
