"""What is kept on disk of a ruling, per rig and vehicle, so that a stop outlives every process.

The folder is the launcher's to name, and to empty: a newly started emulated laboratory starts fresh. In
virtual time and in replays there is no such port.
"""

import json
from dataclasses import dataclass
from typing import ClassVar

from groundstation.declarations.kept_file import EXPECTED, MemoryEdge, file_at
from groundstation.declarations.message import Message
from groundstation.declarations.port import Edge, Port
from groundstation.parts.supervision.messages import Recalled, Supervision
from groundstation.supervision.mode_machine import Memory, Then
from groundstation.supervision.modes import Mode


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
        is_expected = str(self.address).partition("?")[2] == EXPECTED
        return MemoryEdge(file_at(self.address, self.vehicle), is_expected=is_expected)
