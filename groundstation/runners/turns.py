"""Whose turn it is: a node that the rig calls busy takes one message at a time, live and in lockstep."""

from collections.abc import Callable, Iterable

from groundstation.bus.envelope import Delivered
from groundstation.bus.topics import Delivery
from groundstation.runtime.slot import NodeSlot


class Turns:
    """Hands messages to nodes, or lets them wait until a busy node is free again.

    Args:
        publish: Takes what a node said.
        call_back: Takes a stamp and a slot; ``free`` is to be called with that slot at that stamp.
    """

    def __init__(
        self, publish: Callable[[Iterable[Delivered]], None], call_back: Callable[[int, NodeSlot], None]
    ) -> None:
        self._publish = publish
        self._call_back = call_back
        self._waiting: dict[str, list[Delivered]] = {}

    def offer(self, slot: NodeSlot, delivered: Delivered, now_ns: int) -> None:
        """Hand over, or let wait; of a topic with newest delivery only the last one waits."""
        if not slot.timing.busy_ns or slot.busy_until_ns <= now_ns:
            self._hand_over(slot, delivered, now_ns)
            return
        waiting = self._waiting.setdefault(slot.key, [])
        if waiting and delivered.envelope.topic.delivery is Delivery.NEWEST:
            slot.drop(waiting.pop().envelope, now_ns)
        waiting.append(delivered)

    def free(self, slot: NodeSlot, now_ns: int) -> None:
        """A busy node is done: hand over what has waited longest."""
        waiting = self._waiting.get(slot.key)
        if waiting:
            self._hand_over(slot, waiting.pop(0), now_ns)

    def _hand_over(self, slot: NodeSlot, delivered: Delivered, now_ns: int) -> None:
        said = slot.receive(delivered, now_ns)
        if slot.timing.busy_ns:
            slot.busy_until_ns = now_ns + slot.timing.busy_ns
            self._call_back(slot.busy_until_ns, slot)
        self._publish(said)
