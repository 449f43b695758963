"""Publishes requests at the moments at which they are to be made: an operator in virtual time."""

from collections import deque
from collections.abc import Iterable

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request

PERIOD_NS = 10_000_000


class RequestPlayer(Node):
    """Publishes each request when its stamp has come.

    Args:
        requests: Their stamps say when.
    """

    inputs = (Ack,)
    outputs = (Request,)

    def __init__(self, requests: Iterable[Request]) -> None:
        super().__init__("", PERIOD_NS)
        self._waiting = deque(sorted(requests, key=lambda request: request.stamp_ns))

    def receive(self, message: Message, now_ns: int) -> Iterable[Message]:
        del message, now_ns
        return ()

    def tick(self, now_ns: int) -> Iterable[Message]:
        while self._waiting and self._waiting[0].stamp_ns <= now_ns:
            yield self._waiting.popleft()
