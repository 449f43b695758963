"""Guided calibrations of a running vehicle; entry points of the group ``groundstation.wizards``.

A wizard needs no terminal: it takes messages, gives advice and names the requests that a person would make.
Here it is led on a terminal, as a node of its own in a live runner beside the run; a console can lead the
same wizard, and a lockstep runner takes the same node.
"""

from __future__ import annotations

import hashlib
import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol

import zenoh

from calibration.delivery import deliver
from calibration.guidance import Advice
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Provenance
from groundstation.bus.zenoh_bus import HubError
from groundstation.declarations.errors import GroundStationError, UsageError
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, Request, Value
from groundstation.declarations.rig import Rig
from groundstation.launch.asking import user_name
from groundstation.launch.beside import run_beside
from groundstation.launch.running import find_running
from groundstation.rig.read import load_rig

GROUP = "groundstation.wizards"
ADVICE_PERIOD_NS = 1_000_000_000
SILENCE_NS = 10_000_000_000
BEGIN_NS = 3_000_000_000
"""So long it may take to learn what the vehicle does; latched topics come once a second."""
BY_ITSELF = "it moves by itself: hands off, and keep clear of the table"

Wish = tuple[str, Mapping[str, Value]]
"""An action, and its arguments by name."""


class Guide(Protocol):
    """One calibration that is going on."""

    kinds: tuple[type[Message], ...]
    """Classes of the messages that it takes."""

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle."""

    def advice(self, now_s: float) -> Advice:
        """Return what to do now; its step is None when there is enough data."""

    def hindrance(self) -> str:
        """Return why it cannot begin yet, a sentence; empty if it can."""

    def requests(self, now_s: float) -> Iterator[Wish]:
        """Yield what the vehicle has to be asked for, if it is to be driven."""

    def answer(self, action: str, reason: str) -> None:
        """Note that a request was carried out, or (with a reason) refused: a refusal ends the step."""

    def trouble(self) -> str:
        """Return why a driven calibration ends early, a sentence; empty while it goes on."""

    def outcome(self) -> Outcome:
        """Return the result.

        Raises:
            CalibrationRefusedError: The data do not give one.
        """


class Wizard(Protocol):
    """A kind of guided calibration."""

    summary: str

    def begin(self, rig: Rig, vehicle: str) -> Guide:
        """Begin to calibrate a vehicle."""


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
        if self._author and advice.is_new and advice.step is not None and not advice.step.is_rest:
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


def lead(name: str, rig_path: Path, vehicle: str | None, out: Path, *, is_driven: bool) -> None:
    """Lead an operator through a guided calibration of a run that is going on, and write its result.

    Args:
        name: Of the wizard.
        rig_path: Rig file of the run.
        vehicle: The rig's first if None.
        out: TOML to write.
        is_driven: Whether the requests are made here, too.

    Raises:
        UsageError: There is no such wizard, vehicle or run.
        GroundStationError: The run went away, or its data do not give the calibration.
    """
    wizard, rig = load_wizard(name), load_rig(rig_path)
    chosen = vehicle or next(iter(rig.vehicles))
    if chosen not in rig.vehicles:
        raise UsageError(f"{rig_path} has no vehicle {chosen!r} (it has {', '.join(rig.vehicles)}).")
    run = next((found for found in find_running() if chosen in found.vehicles), None)
    if run is None:
        raise UsageError(
            f"no run with a vehicle {chosen!r} is going on: start it with `groundstation run {rig_path}`."
        )
    guide = wizard.begin(rig, chosen)
    node = GuideNode(chosen, guide, _print_advice, user_name() if is_driven else "")
    try:
        run_beside(rig, run.endpoint, "guided_calibration", node, lambda: node.is_done)
    except (zenoh.ZError, HubError) as error:
        raise GroundStationError(f"the run at {run.endpoint} does not let us in: {error}") from error
    if node.trouble:
        raise GroundStationError(node.trouble)
    try:
        found = guide.outcome()
    except CalibrationRefusedError as error:
        raise GroundStationError(f"{chosen}: {error}.") from error
    digest = hashlib.sha256(rig_path.read_bytes()).hexdigest()
    deliver(found, Provenance(f"live, rig {rig_path.name}", digest, datetime.now(UTC)), out)


def _print_advice(advice: Advice) -> None:
    if advice.ended:
        print(f"  {advice.ended}", flush=True)
    if advice.step is None:
        print("That was the last step.", flush=True)
    elif advice.is_new:
        print(f"{advice.step.name}: {advice.step.instruction}", flush=True)
    else:
        print(f"  {100 * advice.done:3.0f} %   {advice.missing}", flush=True)
    if advice.note:
        print(f"         {advice.note}", flush=True)
