"""Fly the laps that a table map is learned from, in virtual time: lanes along x, then lanes along y, turning.

    python examples/survey_laps.py laps.mcap --duration 420
    groundstation calibrate table-map laps.mcap --out table_map.toml --plot table_map.png

Heading changes at every lane, because only turning tells the accelerometers' bias from the table's slope.
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
from groundstation.declarations.rig import Rig
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.operation.messages import SequencePhase
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import load_rig
from groundstation.runners.lockstep import LockstepRunner, Observer
from groundstation.runners.slot import NodeSlot, Sequences

RIG = Path(__file__).parent / "rigs" / "survey_laps.toml"
HALF_X_M, HALF_Y_M = 1.6, 1.1
LANES = 5
THERE_M, THERE_RAD = 0.05, math.radians(4.0)
Pose = tuple[float, float, float]


def lanes(first: int = 0) -> list[Pose]:
    """Poses to visit: there and back in lanes along x, then along y; each a third of a turn further."""
    places = []
    for lane in range(LANES):
        y = HALF_Y_M * (2.0 * lane / (LANES - 1) - 1.0)
        ends = (-HALF_X_M, HALF_X_M) if lane % 2 == 0 else (HALF_X_M, -HALF_X_M)
        places += [(x, y) for x in ends]
    for lane in range(LANES + 1):
        x = HALF_X_M * (1.0 - 2.0 * lane / LANES)
        ends = (HALF_Y_M, -HALF_Y_M) if lane % 2 == 0 else (-HALF_Y_M, HALF_Y_M)
        places += [(x, y) for y in ends]
    places = places[first:] + places[:first]
    return [(x, y, math.remainder(math.tau * i / 3.0, math.tau)) for i, (x, y) in enumerate(places)]


class Survey(Node):
    """Asks for one pose after the other.

    Args:
        vehicle: Whose goals they are.
        poses: To visit, again and again.
    """

    inputs = (SequencePhase, ControlStatus)
    outputs = (Request,)

    def __init__(self, vehicle: str, poses: Sequence[Pose]) -> None:
        super().__init__(vehicle)
        self._poses = poses
        self._asked = 0
        self._is_flying = False

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case SequencePhase():
                self._is_flying = message.phase == "flying"
            case ControlStatus() if self._is_flying and self._is_there(message):
                pose = self._poses[self._asked % len(self._poses)]
                self._asked += 1
                yield Request(now_ns, self.vehicle, self._asked, "survey", "go_to", pose)

    def _is_there(self, status: ControlStatus) -> bool:
        if not self._asked:
            return True
        goal = self._poses[(self._asked - 1) % len(self._poses)]
        is_that_goal = math.dist(status.goal_position_table_m, goal[:2]) < 1e-9
        return (
            is_that_goal and status.error_position_m < THERE_M and abs(status.error_heading_rad) < THERE_RAD
        )


def fly(rig: Rig, duration_s: float, observers: Sequence[Observer], seed: int = 1, first: int = 0) -> None:
    """Fly the survey in lockstep; each observer sees every message."""
    if rig.laboratory is None:
        raise SystemExit("the survey in lockstep needs a rig with a [laboratory]")
    laboratory = load_laboratory(rig.laboratory.name, rig.laboratory.table, seed)
    journal, sequences = JournalWriter(), Sequences()
    slots = build_slots(rig, None, journal, sequences, measure=False)
    for vehicle in rig.vehicles:
        survey = Survey(vehicle, lanes(first))
        slots.append(NodeSlot(f"{vehicle}/survey", survey, "lockstep", 0, journal, sequences, measure=False))
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
    parser.add_argument("--rig", type=Path, default=RIG)
    parser.add_argument("--duration", type=float, default=420.0, help="virtual seconds")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="pose to begin with: another lap")
    arguments = parser.parse_args()
    rig = load_rig(arguments.rig)
    info = recording_info(rig, arguments.rig, arguments.seed, None)
    with Recorder(arguments.recording, info) as recorder:
        fly(rig, arguments.duration, [recorder.record], arguments.seed, arguments.first)
    print(arguments.recording)


if __name__ == "__main__":
    main()
