"""A node in a runner: what it consumes and publishes is counted, journaled and timed, in every runner.

Whatever a node raises leaves its slot as a ``NodeError``, one sentence with its key.
"""

import time
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field

from groundstation.bus.envelope import Cause, Delivered, Envelope
from groundstation.bus.journal import JournalWriter, Kind
from groundstation.declarations.calls import node_error
from groundstation.declarations.errors import NodeError
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.topic import Scope, Topic

_INPUT, _TICK, _OUTPUT = Kind.INPUT, Kind.TICK, Kind.OUTPUT
"""Looked up once: thousands of entries are made a second, and a member of an enum is found slowly."""


@dataclass(slots=True)
class Stream:
    """What one process publishes on one topic of one owner, and the number of the last message."""

    topic: Topic
    owner: str
    last: int


class Sequences:
    """Sequence numbers of everything one process publishes, per topic and owner.

    Args:
        after: The first number is the one after this: a process that starts again repeats none.
    """

    def __init__(self, after: int = 0) -> None:
        self._after = after
        self._streams: dict[tuple[str, str], Stream] = {}

    def stream(self, topic: Topic, owner: str) -> Stream:
        """The stream of a topic of an owner, shared by all who publish on it."""
        key = topic.noun, owner
        found = self._streams.get(key)
        if found is None:
            found = self._streams[key] = Stream(topic, owner, self._after)
        return found

    def next(self, topic: Topic, owner: str) -> int:
        """The next number."""
        stream = self.stream(topic, owner)
        stream.last += 1
        return stream.last


def owner_of(topic: Topic, payload: Message, process: str) -> str:
    """Whose topic it is: the vehicle's, nobody's (rig), or the publishing process's."""
    return process if topic.scope is Scope.PROCESS else payload.vehicle


@dataclass(slots=True)
class Timing:
    """Emulated time that a node takes, from the rig.

    Attributes:
        busy_ns: It takes one message at a time and answers after this long.
        late_ns: It answers late, but takes every message.
    """

    busy_ns: int = 0
    late_ns: int = 0


class _Failed(Node):
    """In the place of a node that raised something, while the others end in good order."""

    def receive(self, message: Message, now_ns: int) -> Iterable[Message]:
        del message, now_ns
        return ()


@dataclass(slots=True)
class Slot:
    """One node with its place in a process.

    Attributes:
        key: ``vehicle/name``, or ``name`` for a node of the rig.
        node: The node.
        process: Name of the process, owner of its process-scoped topics.
        journal: The journal of the process, shared by its slots.
        sequences: The counters of the process, shared by its slots.
        measure: Whether wall times are measured (not in lockstep: they would differ per run).
        timing: Emulated duration.
        vehicles: Of the rig: it may publish for no other. None where the rig is not known.
        busy_until_ns: When a busy node is free again.
        waiting: What waits for a busy node.
        has_failed: It raised something: it is called no more, not even to stop.
        is_journaled: Whether anybody reads the journal.
    """

    key: str
    node: Node
    process: str
    journal: JournalWriter
    sequences: Sequences
    measure: bool
    timing: Timing = field(default_factory=Timing)
    vehicles: Collection[str] | None = None
    busy_until_ns: int = 0
    waiting: list[Delivered] = field(default_factory=list)
    has_failed: bool = False
    is_journaled: bool = field(init=False)
    _newest: Envelope | None = None  # of the node's trigger
    _streams: dict[tuple[type[Message], str], Stream] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.is_journaled = self.journal.is_kept

    def start(self, now_ns: int) -> list[Delivered]:
        """Journal the start and collect what the node publishes first."""
        self.journal.note(Kind.START, self.key, "", self.process, 0, now_ns)
        try:
            return self._wrap(self.node.start(now_ns), now_ns, None)
        except (Exception, SystemExit) as error:
            raise self._failed(error) from error

    def receive(self, delivered: Delivered, now_ns: int) -> list[Delivered]:
        """Deliver one message; the outputs carry the stamps at which they are to be published."""
        envelope, payload = delivered
        node = self.node
        if self.is_journaled:
            topic, owner, sequence = envelope[:3]
            self.journal.note(_INPUT, self.key, topic.noun, owner, sequence, now_ns)
        if type(payload) is node.trigger and envelope.owner == node.vehicle:
            self._newest = envelope
        try:
            return self._wrap(node.receive(payload, now_ns), now_ns, envelope)
        except (Exception, SystemExit) as error:
            raise self._failed(error) from error

    def tick(self, now_ns: int) -> list[Delivered]:
        """Let time pass; what is made then was triggered by the newest message of the node's trigger."""
        if self.is_journaled:
            self.journal.note(_TICK, self.key, "", self.process, 0, now_ns)
        try:
            return self._wrap(self.node.tick(now_ns), now_ns, self._newest)
        except (Exception, SystemExit) as error:
            raise self._failed(error) from error

    def stop(self, now_ns: int) -> list[Delivered]:
        """Collect the node's last messages."""
        self.journal.note(Kind.STOP, self.key, "", self.process, 0, now_ns)
        try:
            return self._wrap(self.node.stop(now_ns), now_ns, None)
        except (Exception, SystemExit) as error:
            raise self._failed(error) from error

    def drop(self, envelope: Envelope, now_ns: int) -> None:
        """Journal that a newer message replaced this one before the node was free."""
        self.journal.note(Kind.DROP, self.key, envelope.topic.noun, envelope.owner, envelope.sequence, now_ns)

    def _failed(self, error: BaseException) -> NodeError:
        """The sentence about what the node did."""
        kind, self.node, self.has_failed = type(self.node), _Failed(self.node.vehicle), True
        return error if isinstance(error, NodeError) else node_error(self.key, kind, error)

    def _wrap(self, made: Iterable[Message], now_ns: int, answered: Envelope | None) -> list[Delivered]:
        begin_ns = time.perf_counter_ns() if self.measure else 0
        payloads = list(made)  # generators do their work here
        if not payloads:
            return []
        wall_ns = time.perf_counter_ns() - begin_ns if self.measure else 0
        publish_ns = now_ns + wall_ns + self.timing.busy_ns + self.timing.late_ns
        new, streams = tuple.__new__, self._streams  # a third of the time of calling a named tuple
        trigger = None
        if answered is not None:
            topic, owner, sequence = answered[:3]
            trigger = new(Cause, (topic.noun, owner, sequence))
        out = []
        for payload in payloads:
            stream = streams.get((type(payload), payload.vehicle)) or self._open(payload)
            topic, owner = stream.topic, stream.owner
            sequence = stream.last = stream.last + 1
            if self.is_journaled:
                self.journal.note(_OUTPUT, self.key, topic.noun, owner, sequence, now_ns, wall_ns)
            envelope = new(Envelope, (topic, owner, sequence, publish_ns, wall_ns, trigger))
            out.append(new(Delivered, (envelope, payload)))
        return out

    def _open(self, payload: Message) -> Stream:
        """Look up once where a kind of payload goes."""
        kind = type(payload)
        if kind not in self.node.outputs:
            raise NodeError(f"{self.key} published {kind.__name__}, which is not among its outputs")
        topic, vehicle, vehicles = kind.TOPIC, payload.vehicle, self.vehicles
        is_own = vehicle == self.node.vehicle  # empty for what a node of the rig states of itself
        if topic.scope is Scope.VEHICLE and vehicles is not None and not is_own and vehicle not in vehicles:
            raise NodeError(
                f"{self.key} published {topic.noun} of a vehicle {vehicle!r:.80}, "
                f"which the rig does not have (it has {', '.join(vehicles)})"
            )
        stream = self.sequences.stream(topic, owner_of(topic, payload, self.process))
        self._streams[kind, vehicle] = stream
        return stream
