"""Outside desk: texts of programs outside in; wrenches and requests out, and what became of them as texts."""

from collections import Counter
from collections.abc import Iterator

from drivers.outside.protocol import (
    ANSWER,
    REQUEST,
    WRENCH,
    TextError,
    Wrong,
    answer_text,
    key_of,
    read_request,
    read_wrench,
    split_key,
)
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.outside.messages import OutsideAnswer, OutsideText, OutsideWrench

PERIOD_NS = 1_000_000_000
MOST_ASKED = 256
"""Requests whose answers are waited for; of more the oldest are forgotten."""
OK, WARNING = 0, 1


class OutsideDesk(Node):
    """Reads what comes from outside; what cannot be used is counted by its reason, and raises nothing.

    Args:
        vehicles: Those of the rig.
    """

    inputs = (OutsideText, Ack)
    outputs = (OutsideWrench, Request, OutsideAnswer, Diagnostics)

    def __init__(self, vehicles: tuple[str, ...]) -> None:
        super().__init__("", PERIOD_NS)
        self._vehicles = vehicles
        self._asked: dict[tuple[str, str, int], None] = {}
        self._counts: Counter[str] = Counter()
        self._reported: Counter[str] = Counter()
        self._trouble = ""

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        del payload
        return (*self._vehicles, "")

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case OutsideText():
                self._counts["replaced"] += message.replaced
                try:
                    made = self._read(message, now_ns)
                except TextError as error:
                    self._counts[error.wrong] += 1
                    self._trouble = f"{message.key}: {error}"
                else:
                    self._counts["taken"] += 1
                    yield made
            case Ack():
                asked = message.vehicle, message.author, message.request_id
                if message.action == WRENCH or asked in self._asked:
                    self._asked.pop(asked, None)
                    yield _answer(message, now_ns)

    def tick(self, now_ns: int) -> Iterator[Message]:
        if self._counts == self._reported:
            return
        self._reported = self._counts.copy()
        names = ("taken", "replaced", *Wrong)
        values = tuple(str(self._counts[name]) for name in names)
        level = WARNING if self._trouble else OK
        yield Diagnostics(now_ns, "", "outside", level, self._trouble, tuple(map(str, names)), values)
        self._trouble = ""

    def _read(self, text: OutsideText, now_ns: int) -> OutsideWrench | Request:
        """A message of ours.

        Raises:
            TextError: It cannot be made.
        """
        vehicle, noun = split_key(text.key)
        if vehicle not in self._vehicles or noun not in (WRENCH, REQUEST):
            known = ", ".join(self._vehicles)
            raise TextError(Wrong.NO_SUCH_VEHICLE, f"there is no vehicle {vehicle!r} (there are {known})")
        if noun == WRENCH:
            wrench = read_wrench(text.content)
            return OutsideWrench(
                text.stamp_ns, vehicle, wrench.author, wrench.id, wrench.force_body_n, wrench.torque_nm
            )
        asked = read_request(text.content)
        self._asked[vehicle, asked.author, asked.id] = None
        while len(self._asked) > MOST_ASKED:
            del self._asked[next(iter(self._asked))]
        return Request(now_ns, vehicle, asked.id, asked.author, asked.action, asked.arguments)


def _answer(ack: Ack, now_ns: int) -> OutsideAnswer:
    content = answer_text(ack.author, ack.request_id, ack.action, accepted=ack.accepted, reason=ack.reason)
    return OutsideAnswer(now_ns, "", key_of(ack.vehicle, ANSWER), content)
