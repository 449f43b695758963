"""Splines from rest to rest, against scipy's own derivatives and quadrature."""

import numpy as np
import pytest

from groundstation.control.spline import RestToRest

FAMILY = RestToRest(37.0, 11)
CONTROL = np.random.default_rng(5).normal(size=(FAMILY.count, 2))
T_S = np.linspace(0.0, 37.0, 4001)


@pytest.mark.parametrize("order", [1, 2])
def test_control_points_of_a_derivative_bound_it(order):
    values = FAMILY.spline(CONTROL, order)(T_S)
    points = FAMILY.derivative(order) @ CONTROL
    assert (values <= points.max(axis=0) + 1e-12).all()
    assert (values >= points.min(axis=0) - 1e-12).all()
    assert values[0] == pytest.approx(points[0])
    assert values[-1] == pytest.approx(points[-1])


def test_the_effort_is_the_integral_of_the_squared_acceleration():
    squared = (FAMILY.spline(CONTROL, 2)(T_S) ** 2).sum(axis=1)
    numeric = float(np.trapezoid(squared, T_S))
    assert np.einsum("ja,jk,ka->", CONTROL, FAMILY.effort(), CONTROL) == pytest.approx(numeric, rel=1e-4)


def test_three_equal_points_at_an_end_are_rest():
    control = CONTROL.copy()
    control[:3], control[-3:] = control[0], control[-1]
    for t_s, place in ((0.0, control[0]), (37.0, control[-1])):
        assert FAMILY.spline(control)(t_s) == pytest.approx(place)
        assert FAMILY.spline(control, 1)(t_s) == pytest.approx([0.0, 0.0], abs=1e-12)
        assert FAMILY.spline(control, 2)(t_s) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_the_moments_of_control_points_make_a_straight_line():
    assert FAMILY.spline(FAMILY.centres_s)(T_S) == pytest.approx(T_S)


def test_a_basis_row_gives_the_value():
    assert FAMILY.basis(T_S[:9]) @ CONTROL == pytest.approx(FAMILY.spline(CONTROL)(T_S[:9]))
