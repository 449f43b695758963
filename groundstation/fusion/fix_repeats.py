"""Fixes that a source gives again: noise never repeats, so such a source is frozen, or plays a loop."""

from __future__ import annotations

from collections import deque

REMEMBERED = 64
"""Poses of each source; a loop of more is not noticed."""
REPEATS = "repeats a fix before"
"""Reason of an account."""

Pose = tuple[float, float, float]
"""x, y (m) and heading (rad)."""


class FixRepeats:
    """The poses that each source gave lately."""

    __slots__ = ("_poses",)

    def __init__(self) -> None:
        self._poses: dict[str, deque[Pose]] = {}

    def is_repeated(self, source: str, pose: Pose) -> bool:
        """Take a pose at its arrival; True where its source gave it before, all three numbers equal."""
        poses = self._poses.setdefault(source, deque(maxlen=REMEMBERED))
        if pose in poses:
            return True
        poses.append(pose)
        return False
