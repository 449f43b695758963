"""A recording as arrays: topics by name, fields by name, for notebooks, plots and exports.

Everything is read by the file's own schemas, so that a recording of an older version has the fields it had.
"""

import difflib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from groundstation.recording.errors import UnknownFieldError, UnknownTopicError
from groundstation.recording.field_name import parse_field
from groundstation.recording.file_types import class_of_schema, is_table
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.topic_table import TopicTable

Array = NDArray[np.float64]


class OpenedRecording(Mapping[str, TopicTable]):
    """The topics of a recording, ``alpha/state`` or ``can_in``. Use it as a context manager.

    A topic is read when it is asked for, and kept.

    Args:
        path: An ``.mcap`` file, or the folder of a run.

    Attributes:
        path: As it was given.
        info: What the recording states about itself: rig, calibrations, seed, software.
        start_ns: First log time, monotonic clock of the host; ``stamp_s`` counts from here.
        duration_s: From the first log time to the last.
        utc_offset_ns: UTC minus that clock; None in virtual time.
        missing: What a recovery left out, in sentences.

    Raises:
        RecordingError: There is no such file, it is no recording, or it was never finished.
    """

    def __init__(self, path: Path) -> None:
        self._recording = recording = Recording(path)
        self.path = path
        self.info: RecordingInfo = recording.info
        self.start_ns = recording.start_ns
        self.duration_s = (recording.stop_ns - recording.start_ns) * 1e-9
        self.utc_offset_ns = recording.info.utc_offset_ns
        self.missing = tuple(recording.missing())
        channels = sorted(recording.known_channels(), key=lambda channel: (channel.owner, channel.noun))
        self._channels = {f"{c.owner}/{c.noun}".removeprefix("/"): c for c in channels if c.messages}
        self._tables: dict[str, TopicTable] = {}

    @property
    def topics(self) -> list[str]:
        """Names of all that hold a message."""
        return list(self._channels)

    @property
    def topics_without_pictures(self) -> list[str]:
        """The same without pictures of cameras and foreign types: what makes tables."""
        return [name for name, channel in self._channels.items() if is_table(channel.schema_name)]

    def check(self, name: str) -> str:
        """The name of a topic as it is listed.

        Raises:
            UnknownTopicError: There is no such topic; the sentence names near ones.
        """
        name = name.removeprefix("/")
        if name not in self._channels:
            raise UnknownTopicError(f"{self.path} has no topic {name!r}: {near(name, self.topics)}")
        return name

    def __getitem__(self, name: str) -> TopicTable:
        """The table of a topic.

        Raises:
            UnknownTopicError: There is no such topic; the sentence names near ones.
            RecordingError: It is of a foreign type, or a chunk of it is damaged.
        """
        name = self.check(name)
        if name not in self._tables:
            channel = self._channels[name]
            kind = class_of_schema(channel.noun, channel.schema_name, channel.schema)
            self._tables[name] = TopicTable(self._recording, name, kind, channel.owner)
        return self._tables[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._channels)

    def __len__(self) -> int:
        return len(self._channels)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name.removeprefix("/") in self._channels

    def field(self, name: str) -> tuple[Array, Array]:
        """Time and values of one number: ``alpha/state.position_table_m[0]``, ``alpha/wrench.force_x_n``.

        Returns:
            ``stamp_s`` and the field, shape (n,) each.

        Raises:
            UnknownTopicError, UnknownFieldError: There is no such thing; the sentence names near ones.
        """
        topic, column, place = parse_field(name)
        table = self[topic]
        values = table[column]
        if values.dtype.kind not in "biuf":
            raise UnknownFieldError(f"{topic}.{column} is no number but {_word(values)}")
        if values.ndim == 1 and place is None:
            return table.stamp_s, _floats(values)
        width = values.shape[1] if values.ndim == 2 else 0
        if place is None or place >= width:
            choices = f"{topic}.{column}[0] to [{width - 1}]" if width else f"{topic}.{column}, one number"
            raise UnknownFieldError(f"{name!r} is no number of it: there is {choices}")
        return table.stamp_s, _floats(values[:, place])

    def forget(self, name: str) -> None:
        """Give back the memory of a topic's table."""
        self._tables.pop(name.removeprefix("/"), None)

    def close(self) -> None:
        """Close the file; tables that were read stay."""
        self._recording.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<recording {self.path}: {self.duration_s:.1f} s, {len(self)} topics>"


def near(name: str, names: list[str]) -> str:
    """Of what there is, what a person may have meant."""
    found = difflib.get_close_matches(name, names, n=3, cutoff=0.5)
    last = name.rpartition("/")[2]
    found += [other for other in names if last and last in other and other not in found][: 3 - len(found)]
    if found:
        return f"did you mean {' or '.join(found)}?"
    return f"there are {', '.join(names[:8])}{', …' if len(names) > 8 else ''}" if names else "it is empty"


def _floats(values: NDArray[Any]) -> Array:
    return np.asarray(values, np.float64)


def _word(values: NDArray[np.generic]) -> str:
    return "a text" if values.dtype.kind in "US" else "a sequence of its own length in each message"
