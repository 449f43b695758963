"""Guided calibrations of a running vehicle; entry points of the group ``groundstation.wizards``.

A wizard needs no terminal: it takes messages, gives advice and names the requests that a person would make.
Here it is led on a terminal; a console can lead the same wizard.
"""

from __future__ import annotations

import getpass
import hashlib
import math
import queue
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from importlib.metadata import entry_points
from pathlib import Path
from time import monotonic, monotonic_ns
from typing import Protocol

import zenoh

from calibration.delivery import deliver
from calibration.guidance import Advice
from calibration.outcome import CalibrationRefusedError, Outcome
from calibration.result import Provenance
from groundstation.bus.topics import Topic
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.cli.errors import UsageError
from groundstation.messages.base import Message
from groundstation.messages.cdr import CodecError
from groundstation.runtime.asking import ask
from groundstation.runtime.errors import GroundStationError
from groundstation.runtime.rig import Rig, load_rig
from groundstation.runtime.running import find_running

GROUP = "groundstation.wizards"
ADVICE_EVERY_S = 1.0
SILENCE_S = 10.0

Request = tuple[str, tuple[float, ...]]
"""Action and numbers."""


class Guide(Protocol):
    """One calibration that is going on."""

    topics: Mapping[str, Topic]
    """What it takes, by noun."""

    def take(self, message: Message, now_ns: int) -> None:
        """Take a message of the vehicle."""

    def advice(self, now_s: float) -> Advice:
        """Return what to do now; its step is None when there is enough data."""

    def requests(self, now_s: float) -> Iterator[Request]:
        """Yield what the vehicle has to be asked for, if it is to be driven."""

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
    except Exception as error:  # whatever somebody's package raises while it is imported
        raise UsageError(f"the guided calibration {name!r} cannot be loaded ({error}).") from error
    return wizard


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
    inbox = _Inbox(guide)
    try:
        with ZenohBus(run.endpoint) as bus:
            bus.subscribe(f"{chosen}/*", inbox.put)
            _lead(guide, inbox, run.endpoint if is_driven else None, chosen)
    except zenoh.ZError as error:
        raise GroundStationError(f"the run at {run.endpoint} does not let us in: {error}") from error
    try:
        found = guide.outcome()
    except CalibrationRefusedError as error:
        raise GroundStationError(f"{chosen}: {error}.") from error
    digest = hashlib.sha256(rig_path.read_bytes()).hexdigest()
    deliver(found, Provenance(f"live, rig {rig_path.name}", digest, datetime.now(UTC)), out)


class _Inbox:
    """Messages from Zenoh's thread to this one."""

    def __init__(self, guide: Guide) -> None:
        self._guide = guide
        self._waiting: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()

    def put(self, key: str, data: bytes, _attachment: bytes) -> None:
        """Take a sample on Zenoh's thread."""
        noun = key.partition("/")[2]
        if noun in self._guide.topics:
            self._waiting.put((noun, data))

    def deliver(self, timeout_s: float) -> bool:
        """Give what has arrived to the guide; False after silence."""
        try:
            noun, data = self._waiting.get(timeout=timeout_s)
        except queue.Empty:
            return False
        while True:
            try:
                message = self._guide.topics[noun].codec.decode(data)
            except CodecError:
                message = None  # of another version of this program: as if it had not arrived
            if message is not None:
                self._guide.take(message, monotonic_ns())
            try:
                noun, data = self._waiting.get_nowait()
            except queue.Empty:
                return True


def _lead(guide: Guide, inbox: _Inbox, endpoint: str | None, vehicle: str) -> None:
    """Print instructions until there is enough data; make the requests if there is an endpoint for them."""
    advised_s, received_s = -math.inf, monotonic()
    while True:
        now_s = monotonic()
        if inbox.deliver(0.2):
            received_s = now_s
        elif now_s - received_s > SILENCE_S:
            raise GroundStationError(f"nothing was received from the vehicle for {SILENCE_S:g} s.")
        if now_s - advised_s < ADVICE_EVERY_S:
            continue
        advised_s = now_s
        advice = guide.advice(now_s)
        if advice.step is None:
            print("Enough data.", flush=True)
            return
        if advice.is_new:
            print(f"{advice.step.name}: {advice.step.instruction}", flush=True)
        else:
            print(f"  {100 * advice.done:3.0f} %   {advice.missing}", flush=True)
        if endpoint is None:
            continue
        for action, numbers in guide.requests(now_s):
            ack = ask(endpoint, vehicle, action, numbers, getpass.getuser(), 3.0)
            if not ack.accepted and action == "go_to":
                print(f"  {action} was refused: {ack.reason}")
