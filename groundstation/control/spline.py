"""Cubic splines from rest to rest: ways whose limits hold at every moment, not only where one looks.

A clamped uniform B-spline lies in the convex hull of its control points, and so do its derivatives of theirs
(C. de Boor, A Practical Guide to Splines, revised ed. 2001, chapters IX and X): a bound on the control points
of position, velocity or acceleration is one on the whole way. Three equal control points at an end mean rest.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

Array = NDArray[np.float64]
_DEGREE = 3
ENDS = 3
"""Control points at either end that are equal: position, no velocity, no acceleration."""


@dataclass(frozen=True, eq=False)
class RestToRest:
    """The family of ways of one duration.

    Args:
        duration_s: From rest to rest.
        spans: Polynomial pieces; there are ``spans + 3`` control points.
    """

    duration_s: float
    spans: int

    @property
    def count(self) -> int:
        """Number of control points."""
        return self.spans + _DEGREE

    @property
    def knots_s(self) -> Array:
        """Clamped and uniform; shape (spans + 7,)."""
        inner = np.linspace(0.0, self.duration_s, self.spans + 1)
        return np.concatenate([np.zeros(_DEGREE), inner, np.full(_DEGREE, self.duration_s)])

    @property
    def centres_s(self) -> Array:
        """Moment that each control point stands for (Greville abscissa); shape (count,)."""
        knots_s = self.knots_s
        centres: Array = (knots_s[1:-3] + knots_s[2:-2] + knots_s[3:-1]) / _DEGREE
        return centres

    def derivative(self, order: int) -> Array:
        """Control points of the derivative from those of the way.

        Args:
            order: 1 or 2.

        Returns:
            Shape (count - order, count).
        """
        matrix, knots_s, degree = np.eye(self.count), self.knots_s, _DEGREE
        for _ in range(order):
            spread = degree / (knots_s[degree + 1 : -1] - knots_s[1 : -degree - 1])
            matrix = spread[:, None] * np.diff(matrix, axis=0)
            knots_s, degree = knots_s[1:-1], degree - 1
        return matrix

    def effort(self) -> Array:
        """The integral of the acceleration's square as a form of the control points, shape (count, count).

        The acceleration is linear between knots, so its square is integrated exactly.
        """
        step_s = self.duration_s / self.spans
        mass = np.diag(np.full(self.spans + 1, 2.0 / 3.0 * step_s))
        mass[0, 0] = mass[-1, -1] = step_s / 3.0
        beside = np.full(self.spans, step_s / 6.0)
        mass += np.diag(beside, 1) + np.diag(beside, -1)
        second = self.derivative(2)
        form: Array = second.T @ mass @ second
        return form

    def basis(self, t_s: Array, order: int = 0) -> Array:
        """Values at moments from control points.

        Args:
            t_s: Moments within the duration, shape (n,).
            order: 0 for positions, 1 for velocities, 2 for accelerations.

        Returns:
            Shape (n, count).
        """
        values: Array = self.spline(np.eye(self.count), order)(t_s)
        return values

    def spline(self, control: Array, order: int = 0) -> BSpline:
        """The way of control points, shape (count, ...), or its derivative."""
        way = BSpline(self.knots_s, control, _DEGREE)
        return way.derivative(order) if order else way
