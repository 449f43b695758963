"""Failure desk: requests to inject a failure in, orders to the laboratory out; its events answer them."""

import json
import math
from collections import deque
from collections.abc import Iterator

from groundstation.declarations.lease import Lease, LeaseCheck
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Action, Argument, ArgumentError, Request, answer
from groundstation.parts.laboratory.messages import FailureOrder, InjectedFailure

PATIENCE_NS = 2_000_000_000
PERIOD_NS = 200_000_000
LONGEST_S = 3600.0

INJECT = Action(
    "inject",
    "failure_desk",
    "let the emulated laboratory inject a failure (emulated rigs only)",
    (
        Argument("failure", "row of the laboratory's table of failures", str),
        Argument("for_s", "how long", float, 0.0, LONGEST_S),
        Argument("parameters", "JSON object of numbers", str, default="{}"),
    ),
)


class FailureDesk(Node):
    """Passes orders on one after the other; the laboratory's next event answers the request.

    Args:
        vehicles: Those that a failure can befall.
    """

    inputs = (Request, Lease, InjectedFailure)
    outputs = (FailureOrder, Ack)

    def __init__(self, vehicles: tuple[str, ...]) -> None:
        super().__init__("", PERIOD_NS)
        self._vehicles = vehicles
        self._lease = LeaseCheck()
        self._waiting: deque[tuple[int, Request, str]] = deque()

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        return (*self._vehicles, "")

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case Request() if message.action == INJECT.name:
                yield from self._order(message, now_ns)
            case Lease():
                self._lease.take(message)
            case InjectedFailure() if self._waiting:
                _, request, failure = self._waiting[0]
                if message.refusal:
                    self._waiting.popleft()
                    yield answer(request, now_ns, message.refusal)
                elif message.is_active and (message.vehicle, message.failure) == (request.vehicle, failure):
                    self._waiting.popleft()
                    yield answer(request, now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        while self._waiting and now_ns - self._waiting[0][0] > PATIENCE_NS:
            _, request, _ = self._waiting.popleft()
            yield answer(request, now_ns, "the laboratory does not answer")

    def _order(self, request: Request, now_ns: int) -> Iterator[Message]:
        refusal = self._lease.objection(request, now_ns)
        if refusal:
            yield answer(request, now_ns, refusal)
            return
        try:
            given = INJECT.read(request)
            parameters = _numbers(str(given["parameters"]))
        except ArgumentError as error:
            yield answer(request, now_ns, str(error))
            return
        failure = str(given["failure"])
        self._waiting.append((now_ns, request, failure))
        for_s = float(given["for_s"])
        yield FailureOrder(now_ns, "", request.vehicle, failure, json.dumps(parameters), for_s)


def _numbers(text: str) -> dict[str, float]:
    try:
        given = json.loads(text)
    except (ValueError, RecursionError):
        given = None
    if not isinstance(given, dict):
        raise ArgumentError("inject: parameters is no JSON object of numbers")
    for name, value in given.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ArgumentError(f"inject: {name} is {value!r}, expected a finite number")
    return {name: float(value) for name, value in given.items()}
