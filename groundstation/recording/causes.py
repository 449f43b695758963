"""What a recorded message was made from, read out of the journals.

A journal says in order what each node consumed and said. What a node says while it handles an input was
triggered by that input; what it says in a tick comes from the newest input of each topic it hears.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from groundstation.bus.journal import NO_NODE, Kind, read_entries
from groundstation.bus.topics import TOPICS, Topic, topic_of
from groundstation.messages.definitions import Journal
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording


class Reference(NamedTuple):
    """A recorded message: topic row, owner, sequence."""

    topic_index: int
    owner: str
    sequence: int

    @property
    def topic(self) -> Topic:
        """The row of the topic table."""
        return TOPICS[self.topic_index]


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a message came from.

    Attributes:
        message: The message.
        node: Key of the node that said it, empty for a port.
        told_ns: When the node was told what made it say so.
        wall_ns: Wall time of that call, 0 in lockstep.
        causes: The trigger first, then the newest of the node's other inputs.
    """

    message: Reference
    node: str
    told_ns: int
    wall_ns: int
    causes: tuple[Reference, ...]


@dataclass(slots=True)
class _NodeMemory:
    newest: dict[tuple[int, str], Reference] = field(default_factory=dict)
    trigger: Reference | None = None


class CauseIndex:
    """Origins of all messages of a recording; about 200 bytes each.

    Args:
        recording: A recording with journals.

    Raises:
        RecordingError: It holds no journal.
    """

    def __init__(self, recording: Recording) -> None:
        self._origins: dict[Reference, Origin] = {}
        memories: dict[str, _NodeMemory] = {}
        journals = 0
        for delivered in recording.delivered([topic_of(Journal)]):
            assert isinstance(delivered.payload, Journal)
            journals += 1
            self._read(delivered.payload, memories)
        if not journals:
            raise RecordingError(f"{recording.path} holds no journal, so causes are not known")

    def __getitem__(self, message: Reference) -> Origin:
        """The origin of a message.

        Raises:
            RecordingError: The journals do not name it.
        """
        try:
            return self._origins[message]
        except KeyError:
            name = f"{message.owner}/{message.topic.noun} number {message.sequence}"
            raise RecordingError(f"the journals name no {name}") from None

    def chain(self, message: Reference) -> Iterator[tuple[int, Origin]]:
        """A message and what it was made from, the nearest first, with the number of steps back.

        Of each topic only the newest message: the loop is closed, so every command has all of the
        past among its causes.
        """
        waiting = deque([(0, message)])
        seen = {(message.topic_index, message.owner)}
        while waiting:
            steps, reference = waiting.popleft()
            origin = self._origins.get(reference)
            if origin is None:
                continue  # before the recording began
            yield steps, origin
            for cause in origin.causes:
                if (cause.topic_index, cause.owner) not in seen:
                    seen.add((cause.topic_index, cause.owner))
                    waiting.append((steps + 1, cause))

    def _read(self, journal: Journal, memories: dict[str, _NodeMemory]) -> None:
        for row in read_entries(journal.entries):
            kind = Kind(int(row["kind"]))
            reference = Reference(int(row["topic"]), journal.names[row["owner"]], int(row["sequence"]))
            if kind is Kind.PORT:
                self._origins[reference] = Origin(reference, "", int(row["now_ns"]), 0, ())
                continue
            if row["node"] == NO_NODE:
                continue
            node = journal.names[row["node"]]
            memory = memories.setdefault(node, _NodeMemory())
            if kind is Kind.INPUT:
                memory.newest[reference.topic_index, reference.owner] = reference
                memory.trigger = reference
            elif kind is Kind.OUTPUT:
                self._origins[reference] = Origin(
                    reference, node, int(row["now_ns"]), int(row["wall_ns"]), _causes(memory)
                )
            else:
                memory.trigger = None


def _causes(memory: _NodeMemory) -> tuple[Reference, ...]:
    trigger = memory.trigger
    others = tuple(reference for reference in memory.newest.values() if reference != trigger)
    return others if trigger is None else (trigger, *others)
