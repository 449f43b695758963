"""One process of a rig: builds its nodes, and runs them until it is asked to stop or the launcher is gone."""

import gc
import os
import pickle
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterable
from contextlib import nullcontext

from drivers.errors import DeviceError
from groundstation.bus.journal import JournalWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.declarations.errors import GroundStationError, RigError, UsageError
from groundstation.files.errors import FileError
from groundstation.launch.child import REFUSAL
from groundstation.launch.forking import give_memory_back
from groundstation.launch.orders import Go, Orders
from groundstation.launch.urgency import go_first
from groundstation.recording.policy import ImagePolicy
from groundstation.rig.plan import gives_way, resolved_ports
from groundstation.rig.read import parse_rig
from groundstation.runners.live import LiveProcess
from groundstation.runners.slot import Sequences, Slot
from groundstation.runners.step import build_slots

SWITCH_INTERVAL_S = 0.0005
"""How long a thread that computes may keep one that reads a port waiting; CPython's 5 ms is late."""

NICENESS = 5
"""Of processes that give way: on a busy machine who flies goes first."""

TROUBLE = 1
"""Exit code of a process that could not go on for a reason that it names on stderr."""


def main(orders: Orders) -> None:
    """Run the nodes of a process; what the fork server calls."""
    obey(run, orders)


def obey(work: Callable[[Orders], None], orders: Orders) -> None:
    """Carry out orders and end the process.

    What the orders name and cannot be used is written in one sentence to stderr.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    code = 0
    try:
        work(orders)
    except (UsageError, FileError, DeviceError) as error:
        code = _end_with(error, REFUSAL)
    except GroundStationError as error:
        code = _end_with(error, TROUBLE)
    sys.stderr.flush()
    os._exit(code)  # all is closed; taking the interpreter apart would cost what the end of a run has not


def _end_with(error: Exception, code: int) -> int:
    if os.environ.get("GROUNDSTATION_DEBUG"):
        traceback.print_exception(error)
    sys.stderr.write(" ".join(str(error).split()) + "\n")
    return code


def wait_for_go() -> Go | None:
    """What the launcher sends once the process may open its ports; None if it ended before."""
    try:
        go = pickle.load(sys.stdin.buffer)
    except EOFError:
        return None
    assert isinstance(go, Go)
    return go


def stop_when_asked(stop: Callable[[], None]) -> None:
    """Call ``stop`` on SIGTERM and when the launcher is gone; Ctrl-C is the launcher's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: stop())

    descriptor = sys.stdin.fileno()

    def watch() -> None:
        while os.read(descriptor, 4096):  # unbuffered: a lock held here would hinder the exit
            pass
        stop()

    threading.Thread(target=watch, name="launcher watch", daemon=True).start()


def run(orders: Orders) -> None:
    """Build the nodes of the process, wait until it may go, run them until asked to stop."""
    rig = parse_rig(orders.rig_text, orders.rig_path, orders.files)
    journal, sequences = JournalWriter(), Sequences(orders.sequences_after)
    try:
        slots = build_slots(rig, orders.process, journal, sequences)
    except ValueError as error:  # a number that no check of the rig file knows of, but some node does
        raise RigError(f"{orders.rig_path}: {error}") from error
    if gives_way(rig, orders.process):
        os.nice(NICENESS)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()  # what lives for ever need not be looked at again, which costs milliseconds
    give_memory_back()
    go = wait_for_go()
    if go is None:
        return
    ports = resolved_ports(rig, orders.process, go.addresses)
    carries_stop = _has_topics_apart(slots)
    if carries_stop:
        go_first()  # before any session or port starts a thread
    apart_session = ZenohBus(orders.endpoint) if carries_stop else nullcontext()
    with ZenohBus(orders.endpoint) as bus, apart_session as apart:
        process = LiveProcess(
            orders.process,
            slots,
            ports,
            bus,
            rig.tables.payloads,
            journal,
            sequences,
            images=ImagePolicy(rig.record.images),
            apart=apart,
        )
        stop_when_asked(process.stop)
        process.run()


def _has_topics_apart(slots: Iterable[Slot]) -> bool:
    """Whether a node here receives or publishes what waits behind nothing: a stop."""
    kinds = (kind for slot in slots for kind in (*slot.node.inputs, *slot.node.outputs))
    return any(kind.TOPIC.is_apart for kind in kinds)
