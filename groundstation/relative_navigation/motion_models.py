"""THE TABLE of what happens between frames, as a command names it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol

from groundstation.relative_navigation.answers import Track
from groundstation.relative_navigation.published_frames import PublishedFrames
from groundstation.relative_navigation.single_frames import SingleFrames
from groundstation.relative_navigation.solvers import PoseSolver
from groundstation.relative_navigation.tracker import MotionTracker
from groundstation.relative_navigation.tracker_settings import Frame, TrackerSettings


class Tracker(Protocol):
    """Frames in, answers out."""

    def look(self, frame: Frame, /) -> Track:
        """Take the next frame."""
        ...


DEFAULT = "hill-euler"
MOTION_MODELS: Mapping[str, Callable[[TrackerSettings, PoseSolver], Tracker]] = MappingProxyType(
    {DEFAULT: MotionTracker, "none": SingleFrames, "published": PublishedFrames}
)
"""Name to what follows a target."""
