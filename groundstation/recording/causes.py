"""What a recorded message was made from, read out of the journals.

A journal names in order what each node consumed and published. What a node publishes while it handles an
input was triggered by that input; what it publishes in a tick comes from the newest input of each topic.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

from groundstation.bus.envelope import Cause
from groundstation.bus.journal import Journal, Kind, read_entries
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a message came from.

    Attributes:
        message: The message.
        node: Key of the node that published it, empty for a port.
        given_ns: When the node was given what made it publish.
        wall_ns: Wall time of that call, 0 in lockstep.
        causes: The trigger first, then the newest of the node's other inputs.
    """

    message: Cause
    node: str
    given_ns: int
    wall_ns: int
    causes: tuple[Cause, ...]


@dataclass(slots=True)
class _NodeMemory:
    newest: dict[tuple[str, str], Cause] = field(default_factory=dict)
    trigger: Cause | None = None

    def causes(self) -> tuple[Cause, ...]:
        others = tuple(cause for cause in self.newest.values() if cause != self.trigger)
        return others if self.trigger is None else (self.trigger, *others)


class CauseIndex:
    """Origins of all messages of a recording; about 200 bytes each.

    Args:
        recording: A recording with journals.

    Raises:
        RecordingError: It holds no journal.
    """

    def __init__(self, recording: Recording) -> None:
        self._origins: dict[Cause, Origin] = {}
        memories: dict[str, _NodeMemory] = {}
        journals = 0
        for delivered in recording.delivered([Journal]):
            assert isinstance(delivered.payload, Journal)
            journals += 1
            self._read(delivered.payload, memories)
        if not journals:
            raise RecordingError(f"{recording.path} holds no journal, so causes are not known")

    def __getitem__(self, message: Cause) -> Origin:
        """The origin of a message.

        Raises:
            RecordingError: The journals do not name it.
        """
        try:
            return self._origins[message]
        except KeyError:
            name = f"{message.owner}/{message.noun} number {message.sequence}"
            raise RecordingError(f"the journals name no {name}") from None

    def chain(self, message: Cause) -> Iterator[tuple[int, Origin]]:
        """A message and what it was made from, the nearest first, with the number of steps back.

        Of each topic only the newest message: the loop is closed, so every command has all of the
        past among its causes.
        """
        waiting = deque([(0, message)])
        seen = {(message.noun, message.owner)}
        while waiting:
            steps, reference = waiting.popleft()
            origin = self._origins.get(reference)
            if origin is None:
                continue  # before the recording began
            yield steps, origin
            for cause in origin.causes:
                if (cause.noun, cause.owner) not in seen:
                    seen.add((cause.noun, cause.owner))
                    waiting.append((steps + 1, cause))

    def _read(self, journal: Journal, memories: dict[str, _NodeMemory]) -> None:
        for now_ns, kind, node, noun, owner, sequence, wall_ns in read_entries(journal):
            message = Cause(noun, owner, sequence)
            if kind == Kind.PORT:
                self._origins[message] = Origin(message, "", now_ns, 0, ())
                continue
            memory = memories.setdefault(node, _NodeMemory())
            if kind == Kind.INPUT:
                memory.newest[noun, owner] = message
                memory.trigger = message
            elif kind == Kind.OUTPUT:
                self._origins[message] = Origin(message, node, now_ns, wall_ns, memory.causes())
            elif kind in (Kind.START, Kind.TICK, Kind.STOP):
                memory.trigger = None
