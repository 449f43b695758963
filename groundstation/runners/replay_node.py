"""One node under replay: what it may be handed next, and what it published last."""

from collections import deque
from collections.abc import Callable, Iterable

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import NoJournal
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.topic import Scope
from groundstation.recording.reader import Recorded
from groundstation.runners.slot import Sequences, Slot, owner_of

NodeFactory = Callable[[str], Node]
"""Makes the node of a key, ``vehicle/name`` or ``name``, from the recording's rig."""


class ReplayedNode:
    """A node, stepped through the same slot as in the other runners, with queues of what it receives.

    Args:
        key: Of the journal.
        prepared: The node for its first start.
    """

    def __init__(self, key: str, prepared: Node) -> None:
        self.key = key
        self.is_started = False
        self._process = ""
        self._prepared = prepared
        self._slot = self._slot_of(prepared)
        self.published: deque[tuple[Message, int]] = deque()
        self._queues: dict[tuple[str, str], deque[Recorded]] = {}
        self._inputs = {kind.TOPIC.noun: kind for kind in prepared.inputs}

    @property
    def node(self) -> Node:
        """The node of the present life."""
        return self._slot.node

    def start(self, factory: NodeFactory, process: str, now_ns: int) -> None:
        """A start in the journal of ``process``; from the second on it had been started again."""
        self._process = process
        self._slot = self._slot_of(factory(self.key) if self.is_started else self._prepared)
        self.is_started = True
        self._keep(self._slot.start(now_ns), now_ns)

    def receive(self, message: Recorded, now_ns: int) -> None:
        """Hand over what the node consumed."""
        self._keep(self._slot.receive(Delivered(message.envelope, message.payload), now_ns), now_ns)

    def tick(self, now_ns: int) -> None:
        """Let time pass."""
        self._keep(self._slot.tick(now_ns), now_ns)

    def stop(self, now_ns: int) -> None:
        """The process ended in good order."""
        self._keep(self._slot.stop(now_ns), now_ns)

    def owner_of(self, payload: Message) -> str:
        """Whose topic it is that the node published on."""
        return owner_of(payload.TOPIC, payload, self._process)

    def queue_for(self, envelope: Envelope) -> deque[Recorded] | None:
        """Where recorded messages of a topic of an owner wait for this node; None if it takes none."""
        noun, owner = envelope.topic.noun, envelope.owner
        kind = self._inputs.get(noun)
        if kind is None or (kind.TOPIC.scope is Scope.VEHICLE and owner not in self.node.sources(kind)):
            return None
        return self._queues.setdefault((noun, owner), deque())

    def find(self, noun: str, owner: str, sequence: int) -> Recorded | None:
        """The message consumed; older ones are forgotten, itself is kept: a latched one may come again."""
        queue = self._queues.get((noun, owner), ())
        for position, message in enumerate(queue):
            if message.envelope.sequence == sequence:
                assert isinstance(queue, deque)
                for _ in range(position):
                    queue.popleft()
                return message
        return None

    def _slot_of(self, node: Node) -> Slot:
        return Slot(self.key, node, self._process, NoJournal(), Sequences(), measure=False)

    def _keep(self, made: Iterable[Delivered], now_ns: int) -> None:
        self.published.extend((delivered.payload, now_ns) for delivered in made)
