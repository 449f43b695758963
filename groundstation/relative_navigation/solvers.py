"""THE TABLE of pose solvers that a command names; all answer to the same call."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.evolved_pose import EvolvedPose
from groundstation.relative_navigation.levenberg import PosePrior, solve_levenberg
from groundstation.relative_navigation.newton import solve_newton
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pose import Pose, PoseFit, Sight


class PoseSolver(Protocol):
    """From centres to a pose."""

    def __call__(
        self,
        camera: PinholeCamera,
        points_body_m: NDArray[np.float64],
        sight: Sight,
        start: Pose,
        prior: PosePrior | None = None,
        /,
    ) -> PoseFit:
        """Return the pose near a start; see `levenberg.solve_levenberg`."""
        ...


DEFAULT = "lm"
SOLVERS: Mapping[str, Callable[[], PoseSolver]] = MappingProxyType(
    {
        DEFAULT: lambda: solve_levenberg,
        "newton": lambda: solve_newton,
        "differential-evolution": EvolvedPose,
    }
)
"""Name to a function that makes one."""
