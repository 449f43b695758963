"""Fly the laps that a table map is learned from, in virtual time: lanes along x, then lanes along y, turning.

    python examples/survey_laps.py laps.mcap --duration 420
    groundstation calibrate table-map laps.mcap --out table_map.toml --plot table_map.png

Heading changes at every lane, because only turning tells the accelerometers' bias from the table's slope.
"""

import math
from collections.abc import Iterable
from pathlib import Path

from waypoints import Pose, Waypoints, command_line, record

from groundstation.rig.read import load_rig

RIG = Path(__file__).parent / "rigs" / "survey_laps.toml"
HALF_X_M, HALF_Y_M = 1.6, 1.1
LANES = 5
NEAR_M, NEAR_RAD = 0.05, math.radians(4.0)


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


def surveys(vehicles: Iterable[str], first: int = 0) -> list[Waypoints]:
    """One node per mock-up."""
    return [Waypoints(name, lanes(first), "survey", NEAR_M, NEAR_RAD) for name in vehicles]


def main() -> None:
    """Fly and record."""
    parser = command_line(__doc__, 420.0)
    parser.add_argument("--rig", type=Path, default=RIG)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="pose to begin with: another lap")
    arguments = parser.parse_args()
    nodes = surveys(load_rig(arguments.rig).vehicles, arguments.first)
    record(arguments.rig, arguments.recording, arguments.duration, nodes, arguments.seed)


if __name__ == "__main__":
    main()
