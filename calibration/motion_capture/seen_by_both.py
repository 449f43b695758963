"""Moments at which a motion-capture system and another source see the same mock-up."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence

import numpy as np

from calibration.motion_capture.alignment import Array, Pairs
from groundstation.frames import wrap_angle

PAIR_EVERY_NS = 100_000_000
KEPT_NS, WAITS_NS = 3_000_000_000, 1_500_000_000
LONGEST_GAP_NS = 100_000_000
"""Between two poses of the system; nothing is interpolated over more."""


class SeenByBoth:
    """Lays poses of the system, which come often, at the moments of the other source's poses.

    Args:
        sigma: Of a pose of the system: m, rad.
    """

    def __init__(self, sigma: tuple[float, float]) -> None:
        self._sigma = sigma
        self._seen: deque[tuple[int, Array]] = deque()
        self._velocity: deque[tuple[int, Array]] = deque()
        self._waiting: deque[tuple[int, Array, tuple[float, float], bool]] = deque()
        self._newest_ns = 0

    @property
    def is_seen(self) -> bool:
        """Whether the system has seen the mock-up."""
        return bool(self._seen)

    @property
    def has_poses(self) -> bool:
        """Whether the other source has."""
        return bool(self._newest_ns)

    def add_seen(self, exposure_ns: int, pose: Array) -> None:
        """A pose (3,) of the system, in its own frame."""
        _keep(self._seen, exposure_ns, pose)

    def add_velocity(self, stamp_ns: int, velocity: Array) -> None:
        """A velocity (3,) of the mock-up, table frame."""
        _keep(self._velocity, stamp_ns, velocity)

    def add_pose(self, stamp_ns: int, pose: Array, sigma: tuple[float, float], is_aside: bool) -> None:
        """A pose (3,) of the other source; it waits until the system's poses around it are here."""
        if stamp_ns - self._newest_ns >= PAIR_EVERY_NS:
            self._newest_ns = stamp_ns
            self._waiting.append((stamp_ns, pose, sigma, is_aside))

    def matched(self) -> Iterator[tuple[int, Array, bool]]:
        """Yield stamp, row for `pairs_of` and whether it is set aside, of each moment seen by both."""
        while self._waiting and self._seen:
            stamp_ns, pose, (xy_m, heading_rad), is_aside = self._waiting[0]
            if stamp_ns - WAITS_NS < self._seen[-1][0] < stamp_ns:
                return
            self._waiting.popleft()
            seen, velocity = _at(self._seen, stamp_ns), _at(self._velocity, stamp_ns)
            if seen is None:
                continue
            sigma = (math.hypot(xy_m, self._sigma[0]), math.hypot(heading_rad, self._sigma[1]))
            moving = np.zeros(3) if velocity is None else velocity
            yield stamp_ns, np.array([*seen, *pose, *moving, *sigma]), is_aside


def pairs_of(rows: Sequence[Array]) -> Pairs:
    """Rows together."""
    table = np.array(rows).reshape(-1, 11)
    return Pairs(table[:, :3], table[:, 3:6], table[:, 6:9], table[:, 9:])


def _keep(kept: deque[tuple[int, Array]], stamp_ns: int, row: Array) -> None:
    if kept and stamp_ns <= kept[-1][0]:
        return
    kept.append((stamp_ns, row))
    while stamp_ns - kept[0][0] > KEPT_NS:
        kept.popleft()


def _at(kept: deque[tuple[int, Array]], stamp_ns: int) -> Array | None:
    """Between the two rows around a moment; None where they are too far apart. The last is a turn."""
    before = None
    for row in reversed(kept):
        if row[0] <= stamp_ns:
            before = row
            break
        after = row
    if before is None or kept[-1][0] < stamp_ns:
        return None
    if before[0] == stamp_ns:
        return before[1]
    if after[0] - before[0] > LONGEST_GAP_NS:
        return None
    share = (stamp_ns - before[0]) / (after[0] - before[0])
    step = after[1] - before[1]
    step[2] = wrap_angle(step[2])
    return np.asarray(before[1] + share * step)
