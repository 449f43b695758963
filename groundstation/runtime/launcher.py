"""Starts the processes of a rig, knows when each is ready, restarts what died, ends all in good order.

The hub lives here. Children have process groups of their own, so that Ctrl-C reaches the launcher
alone; the end of their stdin tells them that the launcher is gone, however it went.
"""

import os
import queue
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import entry_points
from pathlib import Path

import zenoh

from drivers.laboratory import ENTRY_POINT_GROUP, Address, parse_announcement
from groundstation.bus.zenoh_bus import ZenohBus, open_hub
from groundstation.runtime.errors import GroundStationError, RigError
from groundstation.runtime.plan import RECORDER, processes_of
from groundstation.runtime.process import Orders
from groundstation.runtime.rig import Rig

LABORATORY = "laboratory"
COMMANDS = "commands"
ANNOUNCE_TIMEOUT_S = 30.0
FIRST_BACK_OFF_S, LAST_BACK_OFF_S, PROVEN_S = 0.25, 8.0, 20.0
HUNG_S = 4.0
STOP_COMMANDS_S, STOP_ALL_S = 0.7, 2.2

Say = Callable[[str], None]


@dataclass(slots=True)
class Child:
    """One process under the launcher's care."""

    name: str
    popen: subprocess.Popen[bytes] | None = None
    started_s: float = 0.0
    is_ready: bool = False
    restarts: int = 0
    back_off_s: float = FIRST_BACK_OFF_S
    restart_at_s: float | None = None
    last_heard_s: float = 0.0

    @property
    def state(self) -> str:
        """``ready``, ``starting`` or ``waiting`` for its next start."""
        if self.restart_at_s is not None:
            return "waiting"
        return "ready" if self.is_ready else "starting"


class Launcher:
    """Runs a rig live; use it as a context manager, then call ``supervise`` until the end.

    Args:
        rig: The rig.
        rig_path: Its file, for the children.
        recording: Where the recorder writes; None for no recording.
        say: Takes one line about what happens.

    Raises:
        GroundStationError: The laboratory does not start or announces nothing.
    """

    def __init__(self, rig: Rig, rig_path: Path, recording: Path | None, say: Say) -> None:
        self._rig = rig
        self._rig_path = rig_path
        self._recording = recording
        self._say = say
        self._addresses: dict[str, Address] = {}
        self._tidings: queue.SimpleQueue[tuple[str, bool]] = queue.SimpleQueue()
        self._children = {name: Child(name) for name in processes_of(rig)}
        if recording is not None:
            self._children = {RECORDER: Child(RECORDER), **self._children}
        self.endpoint = f"tcp/127.0.0.1:{_free_port()}"
        self._hub: zenoh.Session | None = None
        self.bus: ZenohBus | None = None
        self._laboratory: Child | None = Child(LABORATORY) if rig.laboratory is not None else None

    def start(self) -> None:
        """Open the hub, start the laboratory, then every process."""
        self._hub = open_hub(self.endpoint)
        self.bus = ZenohBus(self.endpoint)
        self.bus.watch(lambda name, alive: self._tidings.put((name, alive)))
        if self._laboratory is not None:
            self._start_laboratory()
        for child in self._children.values():
            self._start(child)

    @property
    def children(self) -> list[Child]:
        """All processes, the laboratory first."""
        first = [self._laboratory] if self._laboratory is not None else []
        return [*first, *self._children.values()]

    @property
    def is_ready(self) -> bool:
        """Whether every process runs."""
        return all(child.is_ready for child in self.children)

    def heard(self, process: str) -> None:
        """Note a sign of life (its journal) of a process; called from the bus's thread."""
        child = self._children.get(process)
        if child is not None:
            child.last_heard_s = time.monotonic()

    def supervise(self) -> None:
        """Look after the children once; call a few times a second."""
        while not self._tidings.empty():
            name, alive = self._tidings.get()
            child = self._children.get(name)
            if child is not None:
                child.is_ready = alive
        if self._laboratory is not None and _has_ended(self._laboratory):
            self._say("the laboratory died: starting it again, and every process with it")
            for child in self._children.values():
                if child.name != RECORDER:
                    _kill(child)
            self._laboratory.restarts += 1
            self._start_laboratory()
        now_s = time.monotonic()
        for child in self._children.values():
            self._look_after(child, now_s)

    def _look_after(self, child: Child, now_s: float) -> None:
        if child.restart_at_s is not None:
            if now_s >= child.restart_at_s:
                child.restart_at_s = None
                child.restarts += 1
                self._start(child)
        elif _has_ended(child):
            assert child.popen is not None
            if now_s - child.started_s > PROVEN_S:
                child.back_off_s = FIRST_BACK_OFF_S
            how = _how_it_ended(child.popen.returncode)
            self._say(f"{child.name} {how}; starting it again in {child.back_off_s:.2g} s")
            child.restart_at_s = now_s + child.back_off_s
            child.back_off_s = min(2 * child.back_off_s, LAST_BACK_OFF_S)
            child.is_ready = False
        elif child.is_ready and child.last_heard_s and now_s - child.last_heard_s > HUNG_S:
            self._say(f"{child.name} has not been heard of for {HUNG_S:g} s: killing it")
            child.last_heard_s = 0.0
            _kill(child)

    def _start(self, child: Child) -> None:
        module = "recorder" if child.name == RECORDER else "process"
        orders = Orders(
            process=child.name,
            rig=str(self._rig_path),
            endpoint=self.endpoint,
            addresses=dict(self._addresses),
            recording=None if self._recording is None else str(_numbered(self._recording, child.restarts)),
            utc_offset_ns=_utc_offset_ns(),
        )
        child.popen = subprocess.Popen(
            [sys.executable, "-m", f"groundstation.runtime.{module}"],
            stdin=subprocess.PIPE,
            start_new_session=True,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )
        child.started_s = time.monotonic()
        child.last_heard_s = 0.0  # judged only from its first journal on; the recorder keeps none
        child.is_ready = False
        assert child.popen.stdin is not None
        try:
            child.popen.stdin.write(orders.line())
            child.popen.stdin.flush()
        except BrokenPipeError:
            self._say(f"{child.name} ended before it had its orders")

    def _start_laboratory(self) -> None:
        laboratory, section = self._laboratory, self._rig.laboratory
        assert laboratory is not None
        assert section is not None
        package = _package_of(section.name)
        laboratory.popen = subprocess.Popen(
            [sys.executable, "-m", package, str(self._rig_path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            env=os.environ | {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
        )
        laboratory.started_s = time.monotonic()
        laboratory.is_ready = False
        self._addresses = self._wait_for_announcement(laboratory.popen)
        laboratory.is_ready = True

    def _wait_for_announcement(self, popen: subprocess.Popen[bytes]) -> dict[str, Address]:
        found: queue.Queue[dict[str, Address] | None] = queue.Queue()
        stdout = popen.stdout
        assert stdout is not None

        def read() -> None:
            for line in stdout:
                announced = parse_announcement(line.decode(errors="replace"))
                if announced is not None:
                    found.put(announced)
            found.put(None)

        threading.Thread(target=read, name="laboratory stdout", daemon=True).start()
        try:
            announced = found.get(timeout=ANNOUNCE_TIMEOUT_S)
        except queue.Empty:
            announced = None
        if announced is None:
            raise GroundStationError(
                f"the laboratory of {self._rig_path} ended or was silent before it announced its ports"
            )
        return announced

    def close(self) -> None:
        """Valves first, then every child, then the hub; nothing is left behind after three seconds."""
        begin_s = time.monotonic()
        commands = self._children.get(COMMANDS)
        if commands is not None:
            _ask_to_end([commands])
            _wait([commands], begin_s + STOP_COMMANDS_S)
        others = [child for child in self._children.values() if child.name != RECORDER]
        _ask_to_end(others)
        _wait(others, begin_s + STOP_ALL_S - 0.7)
        last = [child for child in self.children if child not in others]
        _ask_to_end(last)
        _wait(last, begin_s + STOP_ALL_S)
        for child in self.children:
            _kill(child)
        if self.bus is not None:
            self.bus.close()
        if self._hub is not None and not self._hub.is_closed():
            self._hub.close()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _package_of(name: str) -> str:
    found = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    if name not in found:
        known = ", ".join(sorted(found)) or "none"
        raise RigError(f"laboratory.name: {name!r} is not installed (installed: {known})")
    return found[name].module.partition(".")[0]


def _numbered(recording: Path, restarts: int) -> Path:
    """A recorder that starts again writes a file of its own: nothing recorded is overwritten."""
    return recording if restarts == 0 else recording.with_stem(f"{recording.stem}_{restarts}")


def _utc_offset_ns() -> int:
    return time.clock_gettime_ns(time.CLOCK_REALTIME) - time.monotonic_ns()


def _has_ended(child: Child) -> bool:
    return child.popen is not None and child.popen.poll() is not None


def _how_it_ended(code: int) -> str:
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"


def _ask_to_end(children: list[Child]) -> None:
    for child in children:
        if child.popen is not None and child.popen.poll() is None:
            child.popen.terminate()


def _wait(children: list[Child], until_s: float) -> None:
    for child in children:
        if child.popen is not None:
            try:
                child.popen.wait(timeout=max(0.0, until_s - time.monotonic()))
            except subprocess.TimeoutExpired:
                continue  # killed at the end


def _kill(child: Child) -> None:
    if child.popen is None:
        return
    if child.popen.poll() is None:
        child.popen.kill()
        child.popen.wait()
    for pipe in (child.popen.stdin, child.popen.stdout):
        if pipe is not None:
            pipe.close()
