"""The published state from stars alone: poses of fixes, velocities by the difference of two of them."""

from __future__ import annotations

import math
from typing import NamedTuple

from groundstation.fusion.published_steps import Moving


class StarPose(NamedTuple):
    """A fix: exposure on the estimator's clock, position of the tracked point, heading (not wrapped)."""

    t_s: float
    x_m: float
    y_m: float
    heading_rad: float


class StarStates:
    """Poses of fixes in the order of their exposures."""

    def __init__(self) -> None:
        self.poses: list[StarPose] = []

    @property
    def newest(self) -> StarPose | None:
        """The newest pose."""
        return self.poses[-1] if self.poses else None

    def add(self, pose: StarPose) -> None:
        """Take the next pose; its heading is unwrapped to be nearest to the one before."""
        if self.poses:
            before = self.poses[-1].heading_rad
            turned = math.remainder(pose.heading_rad - before, math.tau)
            pose = pose._replace(heading_rad=before + turned)
        self.poses.append(pose)

    def state(self) -> tuple[Moving, float] | None:
        """Return the state at the newest exposure and the turn rate, rad/s; None without a pose.

        v = (x_2 - x_1) / (t_2 - t_1) and alike for y and heading; zero as long as there is one pose.
        """
        if not self.poses:
            return None
        new = self.poses[-1]
        if len(self.poses) == 1:
            return Moving(new.heading_rad, 0.0, 0.0, new.x_m, new.y_m), 0.0
        old = self.poses[-2]
        span_s = new.t_s - old.t_s
        velocity = (new.x_m - old.x_m) / span_s, (new.y_m - old.y_m) / span_s
        rate = (new.heading_rad - old.heading_rad) / span_s
        return Moving(new.heading_rad, *velocity, new.x_m, new.y_m), rate

    def standing(self) -> Moving | None:
        """Return the newest pose of a vehicle that stands still; None without a pose."""
        if not self.poses:
            return None
        new = self.poses[-1]
        return Moving(new.heading_rad, 0.0, 0.0, new.x_m, new.y_m)

    def forget(self) -> None:
        """Keep the two newest."""
        del self.poses[:-2]
