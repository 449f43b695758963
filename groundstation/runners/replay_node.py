"""One node under replay: what it may be handed next, and what it said last."""

from collections import deque
from collections.abc import Callable, Iterable

from groundstation.bus.topics import Scope, Topic, topic_of
from groundstation.messages.base import Message
from groundstation.nodes.node import Node
from groundstation.recording.reader import Recorded

NodeFactory = Callable[[str], Node]
"""Makes the node of a key, ``vehicle/name`` or ``name``, from the recording's rig."""


class ReplayedNode:
    """A node with queues of the recorded messages that it hears.

    Args:
        key: Of the journal.
        prepared: The node for its first start.
    """

    def __init__(self, key: str, prepared: Node) -> None:
        self.key = key
        self.node = prepared
        self.is_started = False
        self._process = ""
        self.said: deque[tuple[Message, int]] = deque()
        self._queues: dict[tuple[int, str], deque[Recorded]] = {}
        self._heard = {topic_of(kind).index: kind for kind in prepared.inputs}

    def begin(self, factory: NodeFactory, process: str) -> None:
        """A start in the journal of ``process``; from the second on it had been started again."""
        if self.is_started:
            self.node = factory(self.key)
        self.is_started = True
        self._process = process

    def owner_of(self, payload: Message) -> str:
        """Whose topic it is that the node spoke on."""
        return self._process if topic_of(type(payload)).scope is Scope.PROCESS else payload.vehicle

    def queue_for(self, topic: Topic, owner: str) -> deque[Recorded] | None:
        """Where recorded messages of a topic of an owner wait for this node; None if it is deaf to them."""
        kind = self._heard.get(topic.index)
        if kind is None or (topic.scope is Scope.VEHICLE and owner not in self.node.vehicles_heard(kind)):
            return None
        return self._queues.setdefault((topic.index, owner), deque())

    def find(self, index: int, owner: str, sequence: int) -> Recorded | None:
        """The message consumed; older ones are forgotten, itself is kept: a latched one may come again."""
        queue = self._queues.get((index, owner), ())
        for position, message in enumerate(queue):
            if message.envelope.sequence == sequence:
                assert isinstance(queue, deque)
                for _ in range(position):
                    queue.popleft()
                return message
        return None

    def take(self, said: Iterable[Message], now_ns: int) -> None:
        """Collect what a call of the node says."""
        self.said.extend((payload, now_ns) for payload in said)
