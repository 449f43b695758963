"""What the reader process sends to its parent, one JSON object a line. Pure.

`{"ready": true}` once the system has answered; then per frame `{"stamp_ns": …, "bodies": {"name": [x, y, z,
qx, qy, qz, qw], …}}`; or `{"error": "sentence"}`, after which it ends.
"""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from drivers.motion_capture.pose import MotionCapturePose

Numbers = tuple[float, float, float, float, float, float, float]
"""Position (m) and quaternion (scalar last) as the library gave them."""
_UNIT_TOLERANCE = 0.01  # float32 is good to 1e-6; zeros are what a system sends that has nothing to say


@dataclass(frozen=True, slots=True)
class Ready:
    """The system has answered."""


@dataclass(frozen=True, slots=True)
class Failed:
    """The reader ends; `reason` is a sentence."""

    reason: str


@dataclass(frozen=True, slots=True)
class Frame:
    """The bodies that were tracked in one frame, and the host's monotonic stamp of its arrival."""

    stamp_ns: int
    bodies: Mapping[str, Numbers]


def encode(message: Ready | Failed | Frame) -> bytes:
    """The line of a message."""
    reported: dict[str, object]
    match message:
        case Ready():
            reported = {"ready": True}
        case Failed(reason):
            reported = {"error": reason}
        case Frame(stamp_ns, bodies):
            reported = {
                "stamp_ns": stamp_ns,
                "bodies": {name: list(numbers) for name, numbers in bodies.items()},
            }
    return (json.dumps(reported) + "\n").encode()


def decode(line: bytes) -> Ready | Failed | Frame:
    """The message of a line.

    Raises:
        ValueError: The line is none.
    """
    reported = json.loads(line)
    match reported:
        case {"ready": True}:
            return Ready()
        case {"error": str(reason)}:
            return Failed(reason)
        case {"stamp_ns": int(stamp_ns), "bodies": dict(bodies)}:
            return Frame(stamp_ns, {name: _numbers(name, numbers) for name, numbers in bodies.items()})
    raise ValueError(f"no message of a motion-capture reader: {line!r}")


def _numbers(name: str, numbers: list[float]) -> Numbers:
    x, y, z, qx, qy, qz, qw = map(float, numbers)
    return x, y, z, qx, qy, qz, qw


class PoseMaker:
    """Frames to poses: numbers them, notices bodies that are missing, sets nonsense aside.

    Args:
        names: Bodies to expect; others are left out. Empty: every body, expected once it has been seen.
        is_whole: Whether a frame holds every body that is tracked, so that a missing one is not.

    Attributes:
        garbled: Poses set aside: numbers that are not finite, quaternions that are no rotation.
        foreign: Poses of bodies that were not asked for.
    """

    def __init__(self, names: Iterable[str], *, is_whole: bool) -> None:
        self._asked = frozenset(names)
        self._expected = dict.fromkeys(sorted(self._asked))
        self._is_whole = is_whole
        self._frames = 0
        self.garbled = 0
        self.foreign = 0

    def poses(self, frame: Frame) -> list[MotionCapturePose]:
        """The poses of a frame, tracked bodies first."""
        number, self._frames = self._frames, self._frames + 1
        poses = []
        for name, numbers in frame.bodies.items():
            if self._asked and name not in self._asked:
                self.foreign += 1
                continue
            self._expected[name] = None
            pose = _pose(name, number, numbers)
            self.garbled += pose is None
            if pose is not None:
                poses.append(pose)
        if self._is_whole:
            seen = {pose.name for pose in poses}
            poses += [
                MotionCapturePose.untracked(name, number) for name in self._expected if name not in seen
            ]
        return poses


def _pose(name: str, frame: int, numbers: Numbers) -> MotionCapturePose | None:
    x, y, z, *quaternion = numbers
    norm = math.hypot(*quaternion)
    if not all(map(math.isfinite, numbers)) or abs(norm - 1.0) > _UNIT_TOLERANCE:
        return None
    qx, qy, qz, qw = (part / norm for part in quaternion)
    return MotionCapturePose(name, frame, (x, y, z), (qx, qy, qz, qw), is_tracked=True)
