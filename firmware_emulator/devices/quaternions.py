"""Quaternions of a pose, by hand: a hundred poses a second of each mock-up are too many for scipy's 20 us."""

import math

Quaternion = tuple[float, float, float, float]
"""x, y, z, w; unit."""
Triple = tuple[float, float, float]


def about_z(angle_rad: float) -> Quaternion:
    """A turn about z, counter-clockwise seen from its tip."""
    return 0.0, 0.0, math.sin(angle_rad / 2.0), math.cos(angle_rad / 2.0)


def small(x_rad: float, y_rad: float, z_rad: float) -> Quaternion:
    """A turn by so little that the order of its axes does not matter."""
    norm = math.sqrt(1.0 + (x_rad * x_rad + y_rad * y_rad + z_rad * z_rad) / 4.0)
    return x_rad / 2.0 / norm, y_rad / 2.0 / norm, z_rad / 2.0 / norm, 1.0 / norm


def inverse(turn: Quaternion) -> Quaternion:
    """The turn back."""
    return -turn[0], -turn[1], -turn[2], turn[3]


def times(a: Quaternion, b: Quaternion) -> Quaternion:
    """First `b`, then `a`."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def turned(turn: Quaternion, vector: Triple) -> Triple:
    """A vector turned."""
    x, y, z, _ = times(times(turn, (*vector, 0.0)), inverse(turn))
    return x, y, z
