"""Let a node of your own fly: two mock-ups go round rectangles, in virtual time.

    python examples/fly_a_square.py square.mcap --duration 130
    python examples/compare_with_truth.py square.mcap

The node is ``Waypoints`` (waypoints.py): it receives how far the goal is and requests the next corner, as an
operator does. Everything else is the rig's: parser, star tracker, fusion, controller, guard, emulator. A
replay of the recording names the nodes it wants (``--node alpha/fusion``): the rig knows nothing of this one.
"""

import math
from pathlib import Path

from waypoints import Pose, Waypoints, command_line, record

RIG = Path(__file__).with_suffix(".toml")
OUTER = ((-1.4, -1.0), (1.4, -1.0), (1.4, 1.0), (-1.4, 1.0))
INNER = ((-0.75, -0.4), (0.75, -0.4), (0.75, 0.4), (-0.75, 0.4))
"""x, y in the table frame (m), counter-clockwise."""
NEAR_M, NEAR_RAD = 0.02, math.radians(2.0)


def laps(corners: tuple[tuple[float, float], ...], held: int) -> list[Pose]:
    """Poses of one lap from the corner that the rig holds at the start; the nose points along the way."""
    order = [*corners[held:], *corners[:held]]
    ways = zip(order, [*order[1:], order[0]], strict=True)
    return [(x, y, math.atan2(y - y0, x - x0)) for (x0, y0), (x, y) in ways]


def tours() -> list[Waypoints]:
    """One node per mock-up."""
    return [
        Waypoints("alpha", laps(OUTER, 0), "tour", NEAR_M, NEAR_RAD),
        Waypoints("beta", laps(INNER, 2), "tour", NEAR_M, NEAR_RAD),
    ]


def main() -> None:
    """Fly and record."""
    arguments = command_line(__doc__, 130.0).parse_args()
    record(RIG, arguments.recording, arguments.duration, tours())


if __name__ == "__main__":
    main()
