"""The nearest point of half-planes: against a solver, and by hand."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from groundstation.control.half_planes import HalfPlane, nearest


def plane(angle_rad, bound, whose="edge", length=1.0):
    return HalfPlane((length * math.cos(angle_rad), length * math.sin(angle_rad)), length * bound, whose)


def test_a_wish_that_is_allowed_comes_back_itself():
    wish = (0.1, 0.2)
    assert nearest(wish, [plane(0.0, 0.1), plane(1.0, 5.0)]) == (wish, ())
    assert nearest(wish, []) == (wish, ())


def test_one_line_gives_the_foot_and_two_give_the_crossing():
    right, up = plane(0.0, 1.0, "right", 3.0), plane(math.pi / 2.0, 2.0, "up")
    found = nearest((4.0, 1.0), [right, up])
    assert found.point == pytest.approx((1.0, 1.0))
    assert found.active == (right,)
    found = nearest((4.0, 5.0), [right, up])
    assert found.point == pytest.approx((1.0, 2.0))
    assert {each.whose for each in found.active} == {"right", "up"}


def test_conditions_that_contradict_each_other_have_no_point():
    assert nearest((0.0, 0.0), [plane(0.0, -1.0), plane(math.pi, -1.0)]) is None


bounds = st.floats(-1.0, 1.0)
planes_of = st.lists(
    st.tuples(st.floats(-math.pi, math.pi), bounds, st.floats(0.1, 10.0)), min_size=1, max_size=7
)


@given(wish=st.tuples(bounds, bounds), rows=planes_of)
def test_no_allowed_point_is_nearer(wish, rows):
    planes = [plane(angle, bound, length=length) for angle, bound, length in rows]
    found = nearest(wish, planes)
    solved = minimize(
        lambda x: (x[0] - wish[0]) ** 2 + (x[1] - wish[1]) ** 2,
        wish if found is None else found.point,
        jac=lambda x: 2.0 * (np.asarray(x) - wish),
        constraints=[
            {"type": "ineq", "fun": lambda x, a=angle, b=bound: b - math.cos(a) * x[0] - math.sin(a) * x[1]}
            for angle, bound, _ in rows
        ],
        method="SLSQP",
    )
    excess = max(math.cos(a) * solved.x[0] + math.sin(a) * solved.x[1] - b for a, b, _ in rows)
    if found is None:
        assert excess > -1e-6  # the solver found no point well inside either
        return
    for each in planes:
        along = each.normal[0] * found.point[0] + each.normal[1] * found.point[1]
        assert along <= each.bound + 1e-6 * math.hypot(*each.normal)
    if excess <= 1e-9:
        assert math.dist(found.point, wish) <= math.dist(solved.x, wish) + 1e-5


def test_the_foot_and_the_crossing_of_lines_aslant():
    # 3 x + 4 y <= 5 from (3, 4): 20 too much over 25, so back by 0.8 of the normal
    first = HalfPlane((3.0, 4.0), 5.0, "first")
    assert nearest((3.0, 4.0), [first]) == (pytest.approx((0.6, 0.8)), (first,))
    # with 2 x - y <= -5 the foot is outside; they cross at (-15/11, 25/11)
    second = HalfPlane((2.0, -1.0), -5.0, "second")
    for planes in ([first, second], [second, first]):
        found = nearest((3.0, 4.0), planes)
        assert found.point == pytest.approx((-15.0 / 11.0, 25.0 / 11.0))
        assert set(found.active) == {first, second}


def test_of_several_crossings_it_is_the_nearest():
    planes = [plane(angle, 1.0) for angle in (0.0, math.pi / 2.0, -math.pi / 2.0)]
    assert nearest((3.0, -2.0), planes).point == pytest.approx((1.0, -1.0))
    assert nearest((3.0, 2.0), planes).point == pytest.approx((1.0, 1.0))


def test_a_condition_that_holds_at_the_wish_is_not_pulled_at():
    # the foot on "far" would be allowed, and is no answer
    near, far = plane(0.0, 0.0, "near"), plane(math.pi, 5.0, "far")
    assert nearest((1.0, 0.0), [far, near]) == ((0.0, 0.0), (near,))


@pytest.mark.parametrize(("beyond", "is_changed"), [(0.95e-9, False), (1.05e-9, True)])
def test_a_nanometre_beyond_is_rounding(beyond, is_changed):
    right = HalfPlane((1.0, 0.0), 0.0, "right")
    assert bool(nearest((beyond, 0.0), [right]).active) is is_changed


def test_exactly_a_nanometre_beyond_is_rounding_too():
    right, left = HalfPlane((1.0, 0.0), 0.0, "right"), HalfPlane((-1.0, 0.0), 1e-9, "left")
    assert nearest((1e-9, 0.0), [right]) == ((1e-9, 0.0), ())
    # beside a condition that the foot misses by as much
    found = nearest((1.0, 0.0), [right, left._replace(bound=-1e-9)])
    assert found.point == (0.0, 0.0)


@pytest.mark.parametrize(("turned", "crosses"), [(0.95e-9, False), (1.0e-9, False), (1.05e-9, True)])
def test_what_is_parallel(turned, crosses):
    """Lengths of 2 and 4: the product of the components is eight times the sine."""
    flat, steep = HalfPlane((2.0, 0.0), -2.0, "flat"), HalfPlane((-4.0, 4.0 * turned), 0.0, "steep")
    # x <= -1 and x >= turned * y: they meet far below, where y <= -1 / turned
    found = nearest((0.0, 0.0), [flat, steep])
    assert (found is not None) is crosses
    if crosses:
        assert found.point == pytest.approx((-1.0, -1.0 / turned))
