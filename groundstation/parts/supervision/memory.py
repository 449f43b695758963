"""What is kept on disk of a ruling, per rig and vehicle, so that a stop outlives every process.

The folder is the launcher's to name, and to empty: a newly started emulated laboratory starts fresh. In
virtual time and in replays there is no such port.
"""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from groundstation.declarations.message import Message
from groundstation.declarations.port import READ_TIMEOUT_S, Edge, Port
from groundstation.parts.supervision.messages import Recalled, Supervision
from groundstation.supervision.mode_machine import Memory, Then
from groundstation.supervision.modes import Mode

EXPECTED = "expected"
"""Behind the folder's address and a question mark: a process that starts again must find what was kept."""


def text_of(ruling: Supervision) -> str:
    """What is kept of a ruling."""
    kept = {
        "mode": ruling.mode,
        "stop_latched": ruling.stop_latched,
        "flight_wanted": ruling.flight_wanted,
        "then": ruling.then,
        "cause": ruling.cause,
        "author": ruling.author,
        "latched": list(ruling.latched),
    }
    return json.dumps(kept)


def memory_of(recalled: Recalled) -> Memory | None:
    """What was kept; None where nothing was. What cannot be read counts as a stop: a person looks first."""
    if recalled.trouble:
        return _unreadable(recalled.trouble, recalled.stamp_ns)
    if not recalled.content:
        return None
    try:
        given = json.loads(recalled.content)
        return Memory(
            Mode(given["mode"]),
            bool(given["stop_latched"]),
            bool(given["flight_wanted"]),
            Then(given["then"]),
            str(given["cause"]),
            str(given["author"]),
            recalled.stamp_ns,
            tuple(map(str, given.get("latched", ()))),
        )
    except (ValueError, KeyError, TypeError, RecursionError):
        return _unreadable("what was kept of its last mode cannot be read", recalled.stamp_ns)


def _unreadable(why: str, stamp_ns: int) -> Memory:
    return Memory(Mode.LANDING, True, False, Then.LAND, why, "", stamp_ns)


class _MemoryEdge(Edge):
    def __init__(self, path: Path, *, is_expected: bool) -> None:
        from drivers.memory_file import MemoryFile

        self._path, self._is_expected = path, is_expected
        self._file = MemoryFile(path)

    def read(self) -> Iterable[tuple[int, object]]:
        found = self._file.read(READ_TIMEOUT_S)
        if found is None:
            return ()
        stamp_ns, text, trouble = found
        if self._is_expected and not text:
            trouble = trouble or f"{self._path} is gone or empty: what was kept there is lost"
        return ((stamp_ns, (text, trouble)),)

    def write(self, data: object) -> None:
        assert isinstance(data, str)
        self._file.write(data)

    def wake(self) -> None:
        self._file.wake()

    def close(self) -> None:
        self._file.wake()


@dataclass(frozen=True)
class MemoryPort(Port):
    """The last ruling, as it was kept, and the present one, to be kept; delivered before anything else."""

    reads = Recalled
    is_first: ClassVar[bool] = True

    def to_message(self, stamp_ns: int, data: object) -> Message:
        assert isinstance(data, tuple)
        content, trouble = data
        return Recalled(stamp_ns, self.vehicle, content, trouble)

    def writes(self) -> tuple[tuple[type[Message], str], ...]:
        return ((Supervision, self.vehicle),)

    def to_device(self, payload: Message) -> object:
        assert isinstance(payload, Supervision)
        return text_of(payload)

    def open(self) -> Edge:
        folder, _, word = str(self.address).partition("?")
        return _MemoryEdge(Path(folder) / f"{self.vehicle}.json", is_expected=word == EXPECTED)
