"""A node that asks for one pose after the other, and flights with such nodes in virtual time."""

import argparse
import json
import math
from collections.abc import Iterator, Sequence
from itertools import cycle
from pathlib import Path

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Request
from groundstation.declarations.rig import Rig
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.supervision.messages import Supervision
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.rig.read import load_rig, read_text
from groundstation.runners.lockstep import Observer
from groundstation.runners.make_runner import make_runner

Pose = tuple[float, float, float]
"""x, y (m), heading (rad), table frame."""


class Waypoints(Node):
    """Asks for the next pose when the goal before is reached; the first of them is what the rig lets it hold.

    Args:
        vehicle: Whose goals they are.
        poses: To visit, again and again.
        author: Of the requests.
        near_m: A goal is reached within this distance ...
        near_rad: ... and this turn.
    """

    inputs = (Supervision, ControlStatus)
    outputs = (Request,)

    def __init__(
        self, vehicle: str, poses: Sequence[Pose], author: str, near_m: float, near_rad: float
    ) -> None:
        super().__init__(vehicle)
        self._poses = cycle(poses)
        self._author = author
        self._near_m, self._near_rad = near_m, near_rad
        self._goal: Pose | None = None
        self._requests = 0
        self._is_flying = False

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case Supervision():
                self._is_flying = message.mode == "flying"
            case ControlStatus() if self._is_flying and self._is_reached(message):
                x_m, y_m, heading_rad = self._goal = next(self._poses)
                self._requests += 1
                arguments = json.dumps({"x_m": x_m, "y_m": y_m, "heading_rad": heading_rad})
                yield Request(now_ns, self.vehicle, self._requests, self._author, "go_to", arguments)

    def _is_reached(self, status: ControlStatus) -> bool:
        """Whether the vehicle is at its goal; a status of the goal before states nothing of the new one."""
        if self._goal is not None and math.dist(status.goal_position_table_m, self._goal[:2]) > 1e-9:
            return False
        return status.error_position_m < self._near_m and abs(status.error_heading_rad) < self._near_rad


def fly(
    rig: Rig, duration_s: float, nodes: Sequence[Node], observers: Sequence[Observer], seed: int = 1
) -> None:
    """Fly a rig in virtual time with nodes beside its own; each observer sees every message."""
    runner = make_runner(rig, seed, observers, extra_nodes=nodes)
    try:
        runner.run(round(duration_s * 1e9))
    finally:
        runner.close()


def record(rig_path: Path, recording: Path, duration_s: float, nodes: Sequence[Node], seed: int = 1) -> None:
    """Fly a rig file into a recording."""
    rig = load_rig(rig_path)
    info = recording_info(rig, read_text(rig_path), rig_path, seed, utc_offset_ns=None)
    with Recorder(recording, info) as recorder:
        fly(rig, duration_s, nodes, [recorder.record], seed)
    print(recording)


def command_line(description: str | None, duration_s: float) -> argparse.ArgumentParser:
    """What every flight of waypoints is asked."""
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recording", type=Path)
    parser.add_argument("--duration", type=float, default=duration_s, help="virtual seconds")
    return parser
