"""A node that runs beside a rig that is flying: an ordinary live process, of this command."""

import os
from collections.abc import Callable

from groundstation.bus.journal import JournalWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.declarations.node import Node
from groundstation.declarations.rig import Rig
from groundstation.recording.policy import ImagePolicy
from groundstation.runners.live import LiveProcess
from groundstation.runners.slot import Sequences, Slot


def run_beside(rig: Rig, endpoint: str, name: str, node: Node, is_done: Callable[[], bool]) -> None:
    """Run a node until it is done, or until Ctrl-C.

    Args:
        rig: Of the run.
        endpoint: Of its hub.
        name: What the process is called on the bus, its number appended.
        node: The node; its journal and outputs are recorded with the run's.
        is_done: Asked after each of its ticks.

    Raises:
        HubError: The hub is not there.
    """
    process = f"{name}_{os.getpid()}"
    journal, sequences = JournalWriter(), Sequences()
    key = f"{node.vehicle}/{name}" if node.vehicle else name
    slot = Slot(key, node, process, journal, sequences, measure=True)
    with ZenohBus(endpoint) as bus:
        LiveProcess(
            process,
            [slot],
            [],
            bus,
            rig.tables.payloads,
            journal,
            sequences,
            images=ImagePolicy(rig.record.images),
            is_done=is_done,
        ).run()
