"""One child process of the launcher: ``python -m groundstation.runtime.process``.

Its orders are one JSON line on stdin. Stdin then stays open for as long as the launcher lives: its end
means that nobody watches any more, and the process stops in good order, valves first.
"""

import gc
import json
import os
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NoReturn

from drivers.errors import DeviceError
from groundstation.bus.journal import JournalWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.files.errors import CalibrationFileError
from groundstation.runtime.child import REFUSAL
from groundstation.runtime.errors import RigError, UsageError
from groundstation.runtime.live import LiveProcess
from groundstation.runtime.node_table import build_slots
from groundstation.runtime.plan import gives_way, resolved_ports
from groundstation.runtime.rig import parse_rig
from groundstation.runtime.slot import Sequences

SWITCH_INTERVAL_S = 0.0005
"""How long a thread that computes may keep one that reads a port waiting; CPython's 5 ms is late."""

NICENESS = 5
"""Of processes that give way: on a busy machine who flies goes first."""


@dataclass(frozen=True)
class Orders:
    """What a child is told.

    Attributes:
        process: Its name in the plan.
        rig: Path of the rig file.
        rig_text: What the file said when the run began.
        endpoint: Of the hub.
        addresses: Of the laboratory's channels, as announced.
        recording: Path of the recording; used by the recorder.
        utc_offset_ns: UTC minus monotonic clock; used by the recorder.
        sequences_after: Sequence numbers begin after this one.
    """

    process: str
    rig: str
    rig_text: str
    endpoint: str
    addresses: dict[str, Any]
    recording: str | None = None
    utc_offset_ns: int = 0
    sequences_after: int = 0

    def line(self) -> bytes:
        """As it is written to the child's stdin."""
        return json.dumps(asdict(self)).encode() + b"\n"


def read_orders() -> Orders | None:
    """Read the orders from stdin; None if the launcher ended before it gave any."""
    line = sys.stdin.buffer.readline()
    return Orders(**json.loads(line)) if line else None


def obey(run: Callable[[Orders], None]) -> NoReturn:
    """Read the orders, carry them out and end the process.

    What the orders name and cannot be used is said in one sentence on stderr.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    orders, code = read_orders(), 0
    if orders is not None:
        try:
            run(orders)
        except (UsageError, CalibrationFileError, DeviceError) as error:
            sys.stderr.write(" ".join(str(error).split()) + "\n")
            code = REFUSAL
    sys.stderr.flush()
    os._exit(code)  # all is closed; taking the interpreter apart would cost what the end of a run has not


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
    """Build the nodes of the process and run them until told to stop."""
    rig = parse_rig(orders.rig_text, Path(orders.rig))
    journal, sequences = JournalWriter(), Sequences(orders.sequences_after)
    try:
        slots = build_slots(rig, orders.process, journal, sequences)
    except ValueError as error:  # a number that no check of the rig file knows of, but some node does
        raise RigError(f"{orders.rig}: {error}") from error
    ports = [port for port in resolved_ports(rig, orders.addresses) if port.process == orders.process]
    if gives_way(rig, orders.process):
        os.nice(NICENESS)
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    gc.collect()
    gc.freeze()  # what lives for ever need not be looked at again, which costs milliseconds
    with ZenohBus(orders.endpoint) as bus:
        process = LiveProcess(
            orders.process,
            slots,
            ports,
            bus,
            journal,
            sequences,
            publish_images=rig.record.images == "lossless",
        )
        stop_when_asked(process.stop)
        process.run()


if __name__ == "__main__":
    obey(run)
