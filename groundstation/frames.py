"""The frames of the table: one table, and the one angle helper that every room needs.

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

TWO_PI = 2.0 * math.pi


def wrap_angle(angle_rad: float) -> float:
    """Carry an angle into [-pi, pi)."""
    return (angle_rad + math.pi) % TWO_PI - math.pi
