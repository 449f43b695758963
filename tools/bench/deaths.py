"""Stop or land, then kill -9 of each process, of the launcher, and of all: what the mock-ups do afterwards.

The laboratory runs beside the station, as hardware would: it outlives the launcher. Judged by the frames of
the valve nodes and by truth, received by this process, not by what the station believes.
"""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from fault_campaign import RIG

from bench.flying import Flying, flying
from bench.processes import children, words_of
from bench.rows import ROOT, Bench, Row
from groundstation.bus.envelope import Delivered
from groundstation.bus.listener import Listener
from groundstation.launch.asking import ask_each, session_with
from groundstation.launch.stop_button import stop_button
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveStatus

TIMES = 5
VEHICLES = ("alpha", "beta")
CLOSINGS = ("stop", "land")
LAUNCHER, ALL = "launcher", "all"
LATEST_KILL_S = 3.5
"""Drawn up to here after the request: while it brakes, holds, lands, and when it has landed."""
LANDED_WITHIN_S = 12.0
RESTARTED_S = 6.0
"""So long a process needs at most until it is there again and rules."""
AFTER_S = 2.5
"""So long is watched after all processes of a new launcher are ready."""
MOVED_M = 2e-3
AUTHOR = "bench"


@dataclass
class Watched:
    """What became of one vehicle after it was to come down; stamps on the monotonic clock.

    Attributes:
        landed_ns: When its node first reported that the air is off and it is disarmed; None before.
        opened: Frames after that with an open valve.
        afloat: Frames after that with the air on.
        places_m: Where it was by truth after that.
        flew: Rulings after the request that let it fly.
    """

    landed_ns: int | None = None
    opened: int = 0
    afloat: int = 0
    flew: int = 0
    places_m: list[tuple[float, float]] = field(default_factory=list)

    def take(self, delivered: Delivered) -> None:
        """A message about it."""
        message = delivered.payload
        if isinstance(message, Supervision):
            self.flew += self.landed_ns is not None and message.is_in_flight
        elif isinstance(message, ReferenceState) and self.landed_ns is not None:
            self.places_m.append(message.position_table_m)
        elif isinstance(message, ValveStatus):
            if self.landed_ns is None and not message.armed and not message.floating:
                self.landed_ns = message.stamp_ns
            elif self.landed_ns is not None:
                self.opened += message.open_mask != 0
                self.afloat += message.floating

    @property
    def moved_m(self) -> float:
        """How far it went by truth after it had landed."""
        if not self.places_m:
            return 0.0
        places = np.array(self.places_m)
        return float(np.hypot(*(places - places[-1]).T).max())


def measure(bench: Bench) -> list[Row]:
    """A row per way of closing."""
    return [_row(bench, closing) for closing in CLOSINGS]


def _row(bench: Bench, closing: str) -> Row:
    rng = np.random.default_rng([len(closing), 9])
    broken: list[str] = []
    count = 0
    with _laboratory(bench) as rig:
        for victim in _victims(bench, rig):
            for number in range(TIMES):
                bench.say(f"{closing}, then kill {victim}: {number + 1} of {TIMES}")
                after_s = float(rng.uniform(0.0, LATEST_KILL_S))
                for vehicle, seen in _die(bench, rig, closing, victim, after_s).items():
                    count += 1
                    why = _broken(seen)
                    if why:
                        broken.append(f"{victim} after {after_s:.1f} s, {vehicle}: {why}")
    what = f"{closing}, then kill -9 of each process, of the launcher, of all, {TIMES} times each"
    told = f"{len(broken)} of {count}" + (f": {'; '.join(broken)}" if broken else "")
    return Row(f"{what}: a valve opened, air on, or moved after it had landed", "0", told, not broken)


def _broken(seen: Watched) -> str:
    if seen.landed_ns is None:
        return "never landed"
    if seen.opened or seen.afloat or seen.flew:
        return f"{seen.opened} frames open, {seen.afloat} afloat, {seen.flew} rulings in flight"
    return f"moved {1e3 * seen.moved_m:.1f} mm" if seen.moved_m > MOVED_M else ""


@contextmanager
def _laboratory(bench: Bench) -> Iterator[Path]:
    """The laboratory as a process of its own; the rig file of a station beside it."""
    text = RIG.replace("TILT_X", "2e-4").replace("TILT_Y", "-1e-4").replace("starts_by_itself = false\n", "")
    text = text.replace("rest_s = 6.0", "rest_s = 1.5")
    full, station = bench.folder / "laboratory.toml", bench.folder / "station.toml"
    full.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "firmware_emulator", str(full)]
    with subprocess.Popen(
        command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for channel, address in json.loads(process.stdout.readline())["announce"].items():
            text = text.replace(f'"laboratory:{channel}"', _toml(address))
        station.write_text(text[: text.index("[laboratory]")], encoding="utf-8")
        try:
            yield station
        finally:
            process.stdin.close()
            process.wait(10)


def _toml(address: str | dict[str, object]) -> str:
    if isinstance(address, str):
        return json.dumps(address)
    return f"{{ {', '.join(f'{key} = {json.dumps(value)}' for key, value in address.items())} }}"


def _victims(bench: Bench, rig: Path) -> tuple[str, ...]:
    with flying(bench, rig) as flight:
        flight.wait_for("all processes are ready")
        names = sorted(_processes(flight.process.pid))
    return (*names, LAUNCHER, ALL)


def _processes(launcher: int) -> dict[str, int]:
    """Process numbers of a launcher's children and theirs, by name."""
    found = {}
    for pid in children(launcher):
        title, _, name = (words_of(pid) or [""])[0].partition(" ")
        if title == "groundstation" and name:
            found[name] = pid
        found |= _processes(pid)
    return found


def _die(bench: Bench, rig: Path, closing: str, victim: str, after_s: float) -> dict[str, Watched]:
    """Fly, close, kill, watch until all is ready again; a launcher that was killed is started again."""
    with flying(bench, rig) as flight:
        flight.wait_for(r"(\w+): flying", set(VEHICLES))
        seen = {vehicle: Watched() for vehicle in VEHICLES}
        endpoint = flight.rig.endpoint
        _close(endpoint, closing)
        _watch(endpoint, seen, after_s)
        _kill(flight, victim)
        if victim not in (LAUNCHER, ALL):
            _watch(endpoint, seen, RESTARTED_S)
            _watch(endpoint, seen, LANDED_WITHIN_S, until_landed=True)
            return _let_go(endpoint, seen)
    with flying(bench, rig) as flight:
        flight.wait_for("all processes are ready")
        _watch(flight.rig.endpoint, seen, AFTER_S)
        _watch(flight.rig.endpoint, seen, LANDED_WITHIN_S, until_landed=True)
        return _let_go(flight.rig.endpoint, seen)


def _close(endpoint: str, closing: str) -> None:
    if closing == "land":
        ask_each(endpoint, VEHICLES, "land", {}, AUTHOR, 5.0)
        return
    with stop_button(endpoint, VEHICLES, AUTHOR) as button:
        button.press(timeout_s=10.0)
        while button.is_pending:
            button.follow()


def _let_go(endpoint: str, seen: dict[str, Watched]) -> dict[str, Watched]:
    """The next flight is to begin like the first: what a person closed, a person opens."""
    for action in ("release", "fly"):
        ask_each(endpoint, VEHICLES, action, {}, AUTHOR, 5.0)
    return seen


def _watch(endpoint: str, seen: dict[str, Watched], for_s: float, *, until_landed: bool = False) -> None:
    with session_with(endpoint) as bus:
        listener = Listener(bus, (ValveStatus, Supervision, ReferenceState))
        until_s = time.monotonic() + for_s
        while (left_s := until_s - time.monotonic()) > 0:
            if until_landed and all(each.landed_ns is not None for each in seen.values()):
                return
            delivered = listener.take(left_s)
            if delivered is not None and isinstance(
                delivered.payload, Supervision | ValveStatus | ReferenceState
            ):
                seen[delivered.payload.vehicle].take(delivered)


def _kill(flight: Flying, victim: str) -> None:
    named = _processes(flight.process.pid)
    if victim == LAUNCHER:
        doomed = [flight.process.pid]
    elif victim == ALL:
        doomed = [flight.process.pid, *named.values()]
    else:
        doomed = [named[victim]]
    for pid in doomed:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
