"""Rotations as (3, 3) matrices, written out: a library's calls would cost more than the mathematics."""

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_EYE = np.eye(3)
_SMALL_RAD = 1e-6
"""Below it the series of sine and cosine are exact to rounding."""


def cross_matrix(vector: Floats) -> Floats:
    """Return the matrix (3, 3) with ``cross_matrix(a) @ b == a x b``."""
    x, y, z = vector.tolist()
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turn(vector_rad: Floats) -> Floats:
    """Return the rotation by a rotation vector (3,): axis times angle."""
    x, y, z = vector_rad.tolist()
    angle = math.sqrt(x * x + y * y + z * z)
    if angle < _SMALL_RAD:
        a, b, c = 1.0, 0.5, 1.0 - 0.5 * angle * angle
    else:
        a = math.sin(angle) / angle
        b = 2.0 * (math.sin(0.5 * angle) / angle) ** 2
        c = math.cos(angle)
    return np.array(
        [
            [c + b * x * x, b * x * y - a * z, b * x * z + a * y],
            [b * x * y + a * z, c + b * y * y, b * y * z - a * x],
            [b * x * z - a * y, b * y * z + a * x, c + b * z * z],
        ]
    )


def quaternion_of(matrix: Floats) -> Floats:
    """Return the unit quaternion (4,), scalar first and not negative, of a rotation matrix."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    trace = a + e + i
    if trace > 0.0:
        q = (1.0 + trace, h - f, c - g, d - b)
    elif a >= e and a >= i:
        q = (h - f, 1.0 + a - e - i, b + d, c + g)
    elif e >= i:
        q = (c - g, b + d, 1.0 - a + e - i, f + h)
    else:
        q = (d - b, c + g, f + h, 1.0 - a - e + i)
    scale = math.sqrt(sum(x * x for x in q))
    return np.array(q) / math.copysign(scale, q[0])


def matrix_of(quaternion: Floats) -> Floats:
    """Return the rotation matrix of a quaternion (4,), scalar first, of any length above zero."""
    w, x, y, z = (quaternion / math.sqrt(float(quaternion @ quaternion))).tolist()
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def rotation_vector(matrix: Floats) -> Floats:
    """Return the rotation vector (3,) of a matrix, its length at most pi."""
    w, x, y, z = quaternion_of(matrix).tolist()
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 / w if sine < _SMALL_RAD else 2.0 * math.atan2(sine, w) / sine
    return np.array((scale * x, scale * y, scale * z))


def angle_between(one: Floats, other: Floats) -> float:
    """Return the angle of the turn from one rotation matrix to another, 0 to pi."""
    vector = rotation_vector(one @ other.T)
    return math.sqrt(float(vector @ vector))


def orthonormal(matrix: Floats) -> Floats:
    """Return the nearest rotation to one with rounding: a step of Newton's iteration."""
    found: Floats = matrix @ (1.5 * _EYE - 0.5 * (matrix.T @ matrix))
    return found


def turns(vectors_rad: Floats) -> Floats:
    """Return rotations (n, 3, 3) by rotation vectors (n, 3)."""
    angle = np.sqrt(np.einsum("ni,ni->n", vectors_rad, vectors_rad))
    safe = np.maximum(angle, _SMALL_RAD)
    a = np.where(angle < _SMALL_RAD, 1.0, np.sin(safe) / safe)
    b = np.where(angle < _SMALL_RAD, 0.5, 2.0 * (np.sin(0.5 * safe) / safe) ** 2)
    x, y, z = vectors_rad.T
    zero = np.zeros_like(x)
    k = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    found: Floats = _EYE + a[:, None, None] * k + b[:, None, None] * (k @ k)
    return found


def rotation_vectors(matrices: Floats) -> Floats:
    """Return rotation vectors (n, 3) of matrices (n, 3, 3); near half a turn one by one."""
    trace = matrices[:, 0, 0] + matrices[:, 1, 1] + matrices[:, 2, 2]
    if float(trace.min()) < -0.5:
        return np.stack([rotation_vector(each) for each in matrices])
    vector = np.empty((len(matrices), 3))
    vector[:, 0] = matrices[:, 2, 1] - matrices[:, 1, 2]
    vector[:, 1] = matrices[:, 0, 2] - matrices[:, 2, 0]
    vector[:, 2] = matrices[:, 1, 0] - matrices[:, 0, 1]
    double_sine = np.maximum(np.sqrt((vector * vector).sum(axis=1)), 2.0 * _SMALL_RAD)
    angle = np.arctan2(double_sine, trace - 1.0)
    found: Floats = vector * (angle / double_sine)[:, None]
    return found
