"""Flies a request in virtual time before it is made: a process of its own, since it computes for seconds.

Reads a pickled ``Question`` from stdin, writes one JSON object to stdout.
"""

import json
import math
import os
import pickle
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.console.wire import plain
from groundstation.declarations.errors import GroundStationError, NodeError, UsageError
from groundstation.rig.read import parse_rig
from groundstation.scenario.loading import made
from groundstation.scenario.quantities import QUANTITIES
from groundstation.scenario.run_tracks import RunTracks, Span
from groundstation.scenario.running import fly

NICENESS = 10
ASKED_S = 0.5
ROWS_HZ = 10.0
SHOWN = ("gas_ns", "settling_s", "overshoot_mm", "least_edge_mm")
SLOW_M_S = 0.05
"""A flight is given the time that it takes at this speed, and a margin."""
MARGIN_S, LONGEST_S = 10.0, 90.0
REST_S = 1.5
"""The twin rests shorter before it takes off: its zero offsets are no concern here."""


@dataclass(frozen=True)
class Question:
    """What is to be flown.

    Attributes:
        rig_text: Of the rig's file.
        rig_path: The file.
        files: Every file that it names, as when the run began.
        poses: Of all vehicles at present: x (m), y (m), heading (rad).
        vehicle: Who is asked.
        action: For what.
        arguments: Of the action; SI and radians.
    """

    rig_text: str
    rig_path: Path
    files: dict[str, bytes] = field(repr=False)
    poses: dict[str, tuple[float, float, float]]
    vehicle: str
    action: str
    arguments: dict[str, float]


def answer(question: Question) -> dict[str, Any]:
    """Fly it on the emulated twin, without dispersions, from rest where the vehicles are now."""
    rig = parse_rig(question.rig_text, question.rig_path, question.files)
    content: dict[str, Any] = {
        "name": f"{question.action} flown ahead",
        "rig": str(question.rig_path),
        "duration_s": _duration_s(question),
        "seed": 1,
        "changes": {f"mock_ups.{name}.fusion.rest_s": REST_S for name in rig.mock_ups},
        "vehicles": {
            name: {"start": {"x_m": x_m, "y_m": y_m, "heading_deg": math.degrees(heading_rad)}}
            for name, (x_m, y_m, heading_rad) in question.poses.items()
        },
        "timeline": [
            {
                "at_s": ASKED_S,
                "vehicle": question.vehicle,
                "request": question.action,
                "arguments": {
                    name.replace("_rad", "_deg"): math.degrees(value) if name.endswith("_rad") else value
                    for name, value in question.arguments.items()
                },
                "answer": "accepted",  # what is refused is said at once, and is no way
            }
        ],
    }
    judged = fly(made(content, question.rig_path, rig), 1)
    if judged.flown is None:
        return {"refused": f"the twin did not take off: {judged.verdict.reason}", "paths": {}}
    return {
        "refused": judged.verdict.reason,
        "paths": {name: _path(judged.flown, name) for name in judged.flown.tracks},
        "figures": _figures(judged.flown, question.vehicle),
        "duration_s": judged.flown.duration_s,
    }


def _duration_s(question: Question) -> float:
    pose, given = question.poses[question.vehicle], question.arguments
    way_m = math.hypot(given.get("x_m", pose[0]) - pose[0], given.get("y_m", pose[1]) - pose[1])
    return min(round(way_m / SLOW_M_S + MARGIN_S, 1), LONGEST_S)


def _path(flown: RunTracks, name: str) -> list[list[float]]:
    """T (s), x, y (m), heading (rad), a few times a second."""
    truth = flown.tracks[name].truth
    if not len(truth):
        return []
    times_s = np.arange(0.0, truth[-1, 0], 1.0 / ROWS_HZ)
    columns = [np.interp(times_s, truth[:, 0], truth[:, column]) for column in (1, 2, 3)]
    return np.round(np.column_stack((times_s, *columns)), 4).tolist()  # type: ignore[no-any-return]


def _figures(flown: RunTracks, vehicle: str) -> dict[str, float]:
    whole = Span(0.0, flown.duration_s)
    found = {name: QUANTITIES[name].of(flown, (vehicle,), whole).value for name in SHOWN}
    for other in flown.tracks:
        if other != vehicle:
            distance = QUANTITIES["least_distance_mm"].of(flown, (vehicle, other), whole).value
            found["least_distance_mm"] = min(found.get("least_distance_mm", math.inf), distance)
    return found


def main() -> None:
    """Answer the question on stdin."""
    os.nice(NICENESS)
    question = pickle.load(sys.stdin.buffer)
    try:
        found = answer(question)
    except (UsageError, GroundStationError, NodeError) as error:
        reason = " ".join(str(error).split()).removeprefix(f"{question.rig_path}: ")
        found = {"refused": reason, "paths": {}}
    sys.stdout.write(json.dumps(plain(found)))


if __name__ == "__main__":
    main()
