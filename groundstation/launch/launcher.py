"""Starts the processes of a rig, knows when each is ready, restarts what died, ends all in good order.

The hub lives here. The processes are forked from a server that has loaded all they need; the emulated
laboratory, which stands for hardware, is an interpreter of its own. All have sessions of their own, so that
Ctrl-C reaches the launcher alone; the end of their stdin tells them that the launcher is gone, however it
went. Nothing here blocks for long: whoever supervises can always be asked to end.
"""

import pickle
import queue
import socket
import time
from collections.abc import Callable, Iterable
from importlib.metadata import entry_points
from pathlib import Path
from tempfile import TemporaryFile

from drivers.laboratory import ENTRY_POINT_GROUP, Address, parse_announcement
from groundstation.bus.zenoh_bus import ZenohBus, key_of
from groundstation.declarations.errors import GroundStationError, RigError
from groundstation.declarations.names import LABORATORY, RECORDER
from groundstation.declarations.node import COMMANDS
from groundstation.declarations.request import Ack
from groundstation.declarations.rig import STATION_CHANNEL, Rig
from groundstation.launch import attendant, process, recorder
from groundstation.launch.attendant import Attendant
from groundstation.launch.child import REFUSAL, Child, start_python
from groundstation.launch.fork_server import ForkServer
from groundstation.launch.forking import share_one_arena
from groundstation.launch.guests import Guests
from groundstation.launch.memory import claim_memory
from groundstation.launch.orders import Go, Orders
from groundstation.launch.running_time import RunningTime
from groundstation.launch.urgency import going_first
from groundstation.rig.plan import processes_of
from groundstation.rig.read import bytes_of

LOOPBACK_S = 2.0
START_S = 30.0
"""A process that is not ready by then never will be."""
ATTENDED_S = 5.0
"""Attendants start when the flight is ready, or at this time at the latest."""
HOPELESS = 4  # restarts of a process that was never ready
HUNG_S = 4.0
"""Processes publish a batch of the record stream ten times a second, be it empty; the recorder, once."""
STOP_COMMANDS_S, STOP_NODES_S, STOP_ALL_S = 0.7, 1.5, 2.2
SEQUENCES_PER_S = 2000
"""No topic is faster; so numbers of a process that starts again do not repeat those of its last life."""

Say = Callable[[str], None]


class Launcher:
    """Runs a rig live; call ``start``, then ``supervise`` until the end, then ``close``.

    Args:
        rig: The rig.
        rig_text: What its file reported when the rig was read; holds, as do the files that it names, for the
            whole run.
        rig_path: The file.
        recording: Where the recorder writes; None for no recording.
        say: Takes one line about what happens.
        hub_port: Of the hub on loopback; 0 for a free one.
        attendants: Processes beside the rig's; no flight waits for them.
        guests: Where programs of other hosts connect; None: nowhere.

    Raises:
        RigError: The rig names a laboratory that is not installed.
    """

    def __init__(
        self,
        rig: Rig,
        rig_text: str,
        rig_path: Path,
        recording: Path | None,
        say: Say,
        *,
        hub_port: int = 0,
        attendants: Iterable[Attendant] = (),
        guests: Guests | None = None,
    ) -> None:
        self._rig_path = rig_path
        self._rig_text = rig_text
        self._files = bytes_of(rig)
        self._recording = recording
        self._say = say
        self._hub_port = hub_port
        self._guests = guests
        self._addresses: dict[str, Address] | None = None if rig.laboratory is not None else {}
        self._tidings: queue.SimpleQueue[tuple[str, bool]] = queue.SimpleQueue()
        self._children = {name: Child(name) for name in processes_of(rig)}
        if recording is not None:
            self._children = {RECORDER: Child(RECORDER), **self._children}
        self._attendants = {row.name: row for row in attendants}
        self._children |= {name: Child(name) for name in self._attendants}
        self._laboratory: Child | None = None
        if rig.laboratory is not None:
            self._laboratory = Child(LABORATORY)
            self._package = _package_of(rig.laboratory.name)
        self._began_s = 0.0
        self._time = RunningTime()
        self._fork_server = ForkServer(("groundstation.launch.preload",))
        self._unstarted = list(self._children.values())
        self._waiting: set[str] = set()  # started, but not told to go
        self._memory = claim_memory(rig_path, is_emulated=rig.laboratory is not None)
        self.endpoint = ""
        self.bus: ZenohBus | None = None

    def start(self) -> None:
        """Start what processes need; they are started, and go, as soon as that is there."""
        self._began_s = time.monotonic()
        share_one_arena()
        if self._laboratory is not None:
            self._start_laboratory(self._laboratory)  # it takes longest
        self._fork_server.start()  # before the hub, which has threads
        self.endpoint, self.bus = _open_hub(self._hub_port, self._guests)
        self.bus.keep_wanted(key_of(Ack.TOPIC, "*"))  # who asks has come just before
        self.bus.watch(lambda name, alive: self._tidings.put((name, alive)))

    @property
    def children(self) -> list[Child]:
        """All processes, the laboratory first."""
        first = [self._laboratory] if self._laboratory is not None else []
        return [*first, *self._children.values()]

    @property
    def is_ready(self) -> bool:
        """Whether every process runs that a flight needs."""
        return not self.waiting_for

    @property
    def waiting_for(self) -> list[str]:
        """Names of the processes that are not ready, attendants left out."""
        return [
            child.name for child in self.children if not child.is_ready and child.name not in self._attendants
        ]

    @property
    def greetings(self) -> list[str]:
        """What people are told of attendants that are ready, or were."""
        ready = (
            name
            for name in self._attendants
            if name in self._children and self._children[name].has_been_ready
        )
        return [line for name in ready for line in self._attendants[name].greeting]

    @property
    def recorder(self) -> Child | None:
        """The process that records; None where no recording was asked for."""
        return self._children.get(RECORDER)

    def received(self, name: str) -> None:
        """Note a sign of life of a process: a batch of its record stream."""
        child = self._children.get(name)
        if child is not None:
            child.last_sign_s = self._time.now_s

    def supervise(self) -> None:
        """Look after the children once; call a few times a second.

        Raises:
            RigError: A child refuses what the rig states.
            GroundStationError: The laboratory cannot be started.
        """
        while not self._tidings.empty():
            name, alive = self._tidings.get()
            known = self._children.get(name)
            if known is not None:
                known.is_ready = alive
                known.has_been_ready |= alive
        for child in self.children:
            for line in child.complaints():
                self._say(f"{child.name}: {line}")
            if child.name not in self._attendants:
                _raise_refusal(child)
        now_s = time.monotonic()
        self._time.step(now_s)
        if self._fork_server.keep():
            self._say("the fork server has ended; another one was started, the processes go on")
        if self._laboratory is not None:
            self._look_after_laboratory(self._laboratory, now_s)
        if self._unstarted and self._fork_server.is_loaded:
            self._start_waiting()
        self._let_go()
        for child in list(self._children.values()):
            self._look_after(child, now_s)

    def _start_waiting(self) -> None:
        """Start the rig's processes; attendants, which load much, once those have what they need."""
        is_time = self.is_ready or time.monotonic() - self._began_s > ATTENDED_S
        going = [child for child in self._unstarted if is_time or child.name not in self._attendants]
        for child in going:
            self._start(child)
        self._unstarted = [child for child in self._unstarted if child not in going]

    def _look_after_laboratory(self, laboratory: Child, now_s: float) -> None:
        if laboratory.restart_at_s is not None:
            if self._have_the_others_ended(laboratory.restart_at_s, now_s):
                laboratory.restarts += 1
                self._start_laboratory(laboratory)
                for child in self._of_the_laboratory():
                    child.restarts += 1
                    self._start(child)
        elif laboratory.has_ended:
            _raise_refusal(laboratory)
            if self._addresses is None and not laboratory.restarts:
                raise GroundStationError(f"the laboratory {laboratory.how_it_ended()}")
            self._addresses = None
            wait_s = laboratory.back_off(now_s)
            self._say(
                f"the laboratory {laboratory.how_it_ended()}: starting it again in {wait_s:.2g} s, "
                "and every process with it, since its ports are new"
            )
            for child in self._of_the_laboratory():
                child.ask_to_end()  # not killed: what they received of each other is still to be recorded
                child.restart_at_s = None
        elif not laboratory.is_ready:
            self._read_announcement(laboratory)

    def _of_the_laboratory(self) -> list[Child]:
        """The processes that end and begin with it."""
        apart = {RECORDER, *self._attendants}
        return [child for child in self._children.values() if child.name not in apart]

    def _have_the_others_ended(self, due_s: float, now_s: float) -> bool:
        """Whether the laboratory may start again; who has not ended well after it was due is killed."""
        if now_s < due_s:
            return False
        running = [
            child for child in self._of_the_laboratory() if child.pid is not None and not child.has_ended
        ]
        if running and now_s < due_s + STOP_NODES_S:
            return False
        for child in running:
            child.kill()
        return True

    def _read_announcement(self, laboratory: Child) -> None:
        for line in laboratory.output():
            try:
                self._addresses = parse_announcement(line)
            except ValueError as error:
                raise GroundStationError(f"the laboratory announces its ports wrongly: {error}") from error
            if self._addresses is not None:
                laboratory.is_ready = True
                return
        if self._time.now_s - laboratory.started_s > START_S:
            raise GroundStationError(f"the laboratory has not announced its ports for {START_S:g} s")

    def _look_after(self, child: Child, now_s: float) -> None:
        is_apart = child.name == RECORDER or child.name in self._attendants
        if child.pid is None or (not is_apart and self._addresses is None):
            return  # it waits for the fork server or the laboratory
        if child.restart_at_s is not None:
            if now_s >= child.restart_at_s and self._fork_server.is_loaded:
                child.restarts += 1
                self._start(child)
        elif child.name in self._attendants and child.code == REFUSAL:
            self._say(f"{child.name} is given up: it {child.how_it_ended()}")
            del self._children[child.name]
        elif child.has_ended:
            if child.name not in self._attendants:
                _raise_refusal(child)
            how = child.how_it_ended()
            if child.name not in self._attendants and child.restarts >= HOPELESS and not child.has_been_ready:
                raise GroundStationError(
                    f"{child.name} was started {child.restarts + 1} times in vain: it {how}"
                )
            self._say(f"{child.name} {how}; starting it again in {child.back_off(now_s):.2g} s")
        elif child.last_sign_s is None:
            if self._time.now_s - child.started_s > START_S:
                self._say(f"{child.name} is not ready after {START_S:g} s, killing it")
                child.kill()
        elif self._time.now_s - child.last_sign_s > HUNG_S:
            self._say(f"{child.name} hangs: no sign of life for {HUNG_S:g} s, killing it")
            child.kill()

    def _start(self, child: Child) -> None:
        """Fork a process; it builds its nodes while the laboratory and the recorder still start."""
        elapsed_s = time.monotonic() - self._began_s
        orders = Orders(
            process=child.name,
            rig_path=self._rig_path,
            rig_text=self._rig_text,
            files=self._files,
            endpoint=self.endpoint,
            recording=self._recording,
            restarts=child.restarts,
            utc_offset_ns=time.clock_gettime_ns(time.CLOCK_REALTIME) - time.monotonic_ns(),
            sequences_after=round(elapsed_s * SEQUENCES_PER_S) if child.restarts else 0,
            attendant=self._attendants.get(child.name),
        )
        target = process.main
        if child.name == RECORDER:
            target = recorder.main
        elif orders.attendant is not None:
            target = attendant.run
        child.adopt(self._fork_server.fork(child.name, target, orders), self._time.now_s)
        if target is process.main:
            self._waiting.add(child.name)

    def _let_go(self) -> None:
        """Tell processes to go once the ports are known and the recorder listens: replays need all bytes."""
        first = self._children.get(RECORDER)
        if self._addresses is None or not (first is None or first.has_been_ready):
            return
        for name in sorted(self._waiting):
            child = self._children[name]
            child.started_s = self._time.now_s
            memory = self._memory.address(has_kept=child.restarts > 0 and child.has_been_ready)
            own = {"memory": memory, "hub": self.endpoint}
            addresses = {f"{STATION_CHANNEL}{name}": address for name, address in own.items()}
            child.write(pickle.dumps(Go({**self._addresses, **addresses})))
        self._waiting.clear()

    def _start_laboratory(self, laboratory: Child) -> None:
        self._addresses = None
        if not laboratory.restarts:  # new mock-ups; one that is started again stands for the same ones
            self._memory.forget()
        with TemporaryFile() as content:  # a scenario has changed the rig: its file is not what flies
            content.write(self._rig_text.encode())
            content.seek(0)
            number = content.fileno()
            words = ["-m", self._package, str(self._rig_path), "--text-from", str(number)]
            laboratory.adopt(start_python(words, (number,)), self._time.now_s)

    def close(self) -> None:
        """Valves first, then every child, then the hub; nothing is left behind after three seconds."""
        begin_s = time.monotonic()
        commands = self._children.get(COMMANDS)
        if commands is not None:
            commands.ask_to_end()
            commands.wait(begin_s + STOP_COMMANDS_S)
        nodes = [
            child for child in self._children.values() if child.name not in (RECORDER, *self._attendants)
        ]
        last = [child for child in self.children if child not in nodes]
        for group, within_s in ((nodes, STOP_NODES_S), (last, STOP_ALL_S)):
            for child in group:
                child.ask_to_end()
            for child in group:
                child.wait(begin_s + within_s)
        for child in self.children:
            child.release()
        self._fork_server.close()
        self._memory.release()
        if self.bus is not None:
            self.bus.close()


def _raise_refusal(child: Child) -> None:
    """Raise what a child refuses, wherever its end is noticed: it may end between two looks.

    Raises:
        RigError: It refuses what the rig states.
    """
    if child.has_refused:
        raise RigError(child.last_words.removeprefix("groundstation: "))


def _open_hub(port: int, guests: Guests | None) -> tuple[str, ZenohBus]:
    """The hub on a port of loopback, on a free one if it is 0; and where guests connect.

    Raises:
        GroundStationError: There is no loopback, or somebody has the port.
    """
    try:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            address = probe.getsockname()
            probe.listen()
            socket.create_connection(address, timeout=LOOPBACK_S).close()
    except OSError as error:
        raise GroundStationError(
            f"this machine does not reach itself at 127.0.0.1 ({error.strerror or error}): "
            "is its loopback interface up? (ip link set lo up)"
        ) from error
    endpoint = f"tcp/127.0.0.1:{port or address[1]}"
    with going_first():  # its threads, which pass on everybody's messages
        if guests is None:
            return endpoint, ZenohBus(endpoint, is_hub=True)
        also_at, settings = (guests.endpoint,), guests.settings()
        return endpoint, ZenohBus(endpoint, is_hub=True, also_at=also_at, settings=settings)


def _package_of(name: str) -> str:
    found = {point.name: point for point in entry_points(group=ENTRY_POINT_GROUP)}
    if name not in found:
        known = ", ".join(sorted(found)) or "none"
        raise RigError(f"laboratory.name: {name!r} is not installed (installed: {known})")
    return found[name].module.partition(".")[0]
