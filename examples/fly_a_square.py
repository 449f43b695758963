"""Write a node of your own and let it fly: two mock-ups go round rectangles, in virtual time.

    python examples/fly_a_square.py square.mcap --duration 130
    python examples/compare_with_truth.py square.mcap

The node is ``Tour``: it hears how far the goal is and asks for the next corner, by the same requests that an
operator makes. Everything else is the rig's: parser, star tracker, fusion, controller, guard, emulator. A
replay of the recording names the nodes it wants (``--node alpha/fusion``): the rig knows nothing of the tour.
"""

import argparse
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from groundstation.runtime.node_table import build_slots
from groundstation.runtime.ports import ports_of

from drivers.laboratory import load_laboratory
from groundstation.bus.journal import JournalWriter
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Request
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.operation.messages import SequencePhase
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import load_rig
from groundstation.runners.lockstep import LockstepRunner, Observer
from groundstation.runners.slot import NodeSlot, Sequences

Corners = tuple[tuple[float, float], ...]

RIG = Path(__file__).with_suffix(".toml")
OUTER = ((-1.4, -1.0), (1.4, -1.0), (1.4, 1.0), (-1.4, 1.0))
INNER = ((-0.75, -0.4), (0.75, -0.4), (0.75, 0.4), (-0.75, 0.4))
"""x, y in the table frame (m), counter-clockwise; the nose points along the way."""
THERE_M, THERE_RAD = 0.02, math.radians(2.0)


class Tour(Node):
    """Asks for one corner after the other.

    Args:
        vehicle: Whose goals they are.
        corners: x, y of each (m).
        first: Index of the corner that the rig lets it hold at the start.
    """

    inputs = (SequencePhase, ControlStatus)
    outputs = (Request,)

    def __init__(self, vehicle: str, corners: Corners, first: int) -> None:
        super().__init__(vehicle)
        self._corners = corners
        self._corner = first
        self._is_flying = False
        self._asked = 0

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case SequencePhase():
                self._is_flying = message.phase == "flying"
            case ControlStatus() if self._is_flying:
                goal = self._corners[self._corner]
                is_that_goal = math.dist(message.goal_position_table_m, goal) < 1e-9
                is_there = message.error_position_m < THERE_M and abs(message.error_heading_rad) < THERE_RAD
                if is_that_goal and is_there:
                    self._corner = (self._corner + 1) % len(self._corners)
                    self._asked += 1
                    yield Request(now_ns, self.vehicle, self._asked, "tour", "go_to", self._pose())

    def _pose(self) -> tuple[float, float, float]:
        """The corner, with the nose along the way that led there."""
        (x0, y0), (x, y) = self._corners[self._corner - 1], self._corners[self._corner]
        return x, y, math.atan2(y - y0, x - x0)


def fly(duration_s: float, observers: Sequence[Observer], seed: int = 1) -> None:
    """Fly the tour in lockstep; each observer sees every message."""
    rig = load_rig(RIG)
    assert rig.laboratory is not None
    laboratory = load_laboratory(rig.laboratory.name, rig.laboratory.table, seed)
    journal, sequences = JournalWriter(), Sequences()
    slots = build_slots(rig, None, journal, sequences, measure=False)
    for vehicle, corners, first in (("alpha", OUTER, 0), ("beta", INNER, 2)):
        tour = Tour(vehicle, corners, first)
        slots.append(NodeSlot(f"{vehicle}/tour", tour, "lockstep", 0, journal, sequences, measure=False))
    runner = LockstepRunner(slots, laboratory, ports_of(rig), observers, journal, sequences)
    try:
        runner.run(round(duration_s * 1e9))
    finally:
        runner.close()


def main() -> None:
    """Fly and record."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    parser.add_argument("--duration", type=float, default=130.0, help="virtual seconds")
    arguments = parser.parse_args()
    with Recorder(arguments.recording, recording_info(load_rig(RIG), RIG, 1, None)) as recorder:
        fly(arguments.duration, [recorder.record])
    print(arguments.recording)


if __name__ == "__main__":
    main()
