"""A guided calibration led as a node among others, wherever nodes run: live, in lockstep, in the console."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib.metadata import entry_points

from groundstation.declarations.errors import UsageError
from groundstation.declarations.guide import Advice, Guide, Wizard
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request

GROUP = "groundstation.wizards"
ADVICE_PERIOD_NS = 1_000_000_000
SILENCE_NS = 10_000_000_000
BEGIN_NS = 3_000_000_000
"""So long it may take to learn what the vehicle does; latched topics come once a second."""
BY_ITSELF = "it moves by itself: hands off, and keep clear of the table"


def wizard_names() -> tuple[str, ...]:
    """Names of the installed wizards, in order."""
    return tuple(sorted({point.name for point in entry_points(group=GROUP)}))


def load_wizard(name: str) -> Wizard:
    """Return an installed wizard.

    Raises:
        UsageError: There is none of that name, or it cannot be loaded.
    """
    found = {point.name: point for point in entry_points(group=GROUP)}
    if name not in found:
        raise UsageError(f"there is no guided calibration {name!r}; installed: {', '.join(sorted(found))}.")
    try:
        wizard: Wizard = found[name].load()
    except (Exception, SystemExit) as error:  # whatever somebody's package raises while it is imported
        raise UsageError(f"the guided calibration {name!r} cannot be loaded ({error}).") from error
    return wizard


class GuideNode(Node):
    """Leads a guide as a node among others: what it is given is journaled, what it asks for is recorded.

    Args:
        vehicle: Which one.
        guide: The calibration.
        advise: Takes each piece of advice.
        author: In whose name requests are made; empty where the operator makes them.

    Attributes:
        is_done: There is enough data, or it cannot begin, or a person took the vehicle, or nothing arrives.
        trouble: Why it ended without enough data; empty otherwise.
    """

    outputs = (Request,)

    def __init__(self, vehicle: str, guide: Guide, advise: Callable[[Advice], None], author: str) -> None:
        super().__init__(vehicle, ADVICE_PERIOD_NS)
        self.inputs = (*guide.kinds, Ack)
        self._guide = guide
        self._advise = advise
        self._author = author
        self._numbers = itertools.count(1)
        self._received_ns: int | None = None
        self._began_ns: int | None = None
        self._has_begun = False
        self._sent: set[int] = set()
        self.is_done = False
        self.trouble = ""

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        if isinstance(message, Ack):
            if message.author == self._author and message.request_id in self._sent:
                self._sent.discard(message.request_id)
                self._guide.answer(message.action, message.reason)
        else:
            self._received_ns = now_ns
            self._guide.take(message, now_ns)
        yield from ()

    def tick(self, now_ns: int) -> Iterator[Message]:
        if self.is_done:
            return
        if self._began_ns is None:
            self._began_ns = now_ns
        self.trouble = self._hindrance(now_ns)
        if self.trouble:
            self.is_done = True
        if self.is_done or not self._has_begun:
            return
        advice = self._guide.advice(now_ns * 1e-9)
        step = advice.step
        is_flown = step is not None and not step.is_rest and not step.is_by_hand
        if self._author and advice.is_new and is_flown:
            advice = replace(advice, note="; ".join(filter(None, (BY_ITSELF, advice.note))))
        self._advise(advice)
        if advice.step is None:
            self.is_done = True
        elif self._author:
            for action, arguments in self._guide.requests(now_ns * 1e-9):
                number = next(self._numbers)
                self._sent.add(number)
                text = json.dumps(dict(arguments))
                yield Request(now_ns, self.vehicle, number, self._author, action, text)

    def _hindrance(self, now_ns: int) -> str:
        """Why it ends; empty while it goes on, or while it is still to be seen whether it can begin."""
        began_ns = self._began_ns or now_ns
        if not self._has_begun:
            hindrance = self._guide.hindrance()
            self._has_begun = not hindrance
            return hindrance if now_ns - began_ns >= BEGIN_NS else ""
        if now_ns - (self._received_ns or began_ns) > SILENCE_NS:
            what = "nothing was received from the vehicle for 10 s"
            return f"{what}: its run has ended or hangs; nothing was written."
        return self._guide.trouble() if self._author else ""
