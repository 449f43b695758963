"""A pose from matched points of the ceiling, for methods that only match."""

import numpy as np
from numpy.typing import NDArray

from bench.star.score import Answer
from groundstation.frames import rigid_fit

ROUNDS = 3
SIGMAS = 3.0


def rigid_pose(q_body_m: NDArray[np.complex128], goal_m: NDArray[np.complex128]) -> Answer:
    """Least squares for ``goal = position + turn q``, points beyond three robust sigmas left out.

    Args:
        q_body_m: Points along the body's axes, shape (n,), as x + iy.
        goal_m: The same in table axes.
    """
    turn, shift = rigid_fit(q_body_m, goal_m)
    for _ in range(ROUNDS):
        residual = np.abs(turn * q_body_m + shift - goal_m)
        kept = residual <= max(SIGMAS * float(np.median(residual)), 1e-6)
        turn, shift = rigid_fit(q_body_m[kept], goal_m[kept])
    return float(shift.real), float(shift.imag), float(np.angle(turn))
