"""The frames of the table: one table, and the turns between them that every room needs.

========  =======================================  ===============================================
frame     origin                                   axes
========  =======================================  ===============================================
table     fixed by the star survey's anchors       x, y in the table, z up, right-handed
body      centre of mass of the mock-up            x forward, y left, z up
imu       accelerometer proof mass                 parallel to body (misalignment is calibration)
camera    optical centre                           x right, y down, z forward (up to the ceiling)
ceiling   the table's origin carried straight up   parallel to table
========  =======================================  ===============================================

Heading is counter-clockwise from table +x to body +x. Names of rotations read
``table_from_body``: neighbours must match. ``position_table_m`` is a position in the table frame.
"""

import math

import numpy as np
from numpy.typing import NDArray

TWO_PI = 2.0 * math.pi


def wrap_angle(angle_rad: float) -> float:
    """Carry an angle into [-pi, pi)."""
    return (angle_rad + math.pi) % TWO_PI - math.pi


def turned_axes(yaw_rad: float, tilt_x_rad: float, tilt_y_rad: float) -> NDArray[np.float64]:
    """``Rz(yaw) Rx(tilt_x) Ry(tilt_y)``, shape (3, 3)."""
    cz, sz = math.cos(yaw_rad), math.sin(yaw_rad)
    cx, sx = math.cos(tilt_x_rad), math.sin(tilt_x_rad)
    cy, sy = math.cos(tilt_y_rad), math.sin(tilt_y_rad)
    about_z = np.array([[cz, -sz, 0.0], [sz, cz, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cx, -sx], [0.0, sx, cx]])
    about_y = np.array([[cy, 0.0, sy], [0.0, 1.0, 0.0], [-sy, 0.0, cy]])
    return np.asarray(about_z @ about_x @ about_y)


def rigid_fit(q_m: NDArray[np.complex128], goal_m: NDArray[np.complex128]) -> tuple[complex, complex]:
    """Give turn and shift with goal = turn q + shift in the least-squares sense."""
    q_mean, goal_mean = q_m.mean(), goal_m.mean()
    product = complex(((goal_m - goal_mean) * np.conj(q_m - q_mean)).sum())
    turn = product / max(abs(product), 1e-300)
    return turn, complex(goal_mean - turn * q_mean)
