"""Closed curves and the played target, against closed solutions."""

import math

import numpy as np
import pytest
from scipy.special import ellipj

from groundstation.control.controllers import make_controller
from groundstation.control.curves import FigureEight, Perimeter
from groundstation.control.keep_in import rectangle
from groundstation.control.state import ControlState, Goal
from groundstation.control.tumble import TumbleConfig, vertical_rates
from groundstation.control.vehicle import VehicleModel, square_of_eight

VEHICLE = VehicleModel(11.0, 0.25, square_of_eight())
TABLE = rectangle((4.0, 3.0), margin_m=0.2)
HERE = Goal((0.0, 0.0), 0.0)
PERIMETER = {"shape": "perimeter", "size_m": (2.0, 1.6)}
EIGHT = {"shape": "figure_eight", "size_m": (2.4, 1.2), "speed_m_s": 0.05}


def flown(name, parameters, start, seconds, dt_s=0.1):
    """Setpoints of a mock-up that is always where the law wants it."""
    law = make_controller(name, parameters, VEHICLE, TABLE)
    state, places = ControlState(start, (0.0, 0.0), 0.0, 0.0), []
    for _ in range(round(seconds / dt_s)):
        law.update(state, HERE, dt_s)
        goal = law.setpoint(HERE)
        state = ControlState(
            goal.position_table_m, goal.velocity_table_m_s, goal.heading_rad, goal.rate_rad_s
        )
        places.append(goal)
    return places


@pytest.mark.parametrize(
    ("curve", "length_m"),
    [
        (Perimeter((0.1, 0.2), (2.0, 1.6), 0.3), 2 * (1.4 + 1.0) + math.tau * 0.3),
        (FigureEight((0.1, 0.2), (2.4, 1.2)), None),
    ],
)
def test_a_curve_closes_and_its_direction_and_curvature_are_those_of_its_places(curve, length_m):
    if length_m is not None:
        assert curve.length_m == pytest.approx(length_m)
    assert curve.at(curve.length_m).position_table_m == pytest.approx(
        curve.at(0.0).position_table_m, abs=1e-6
    )
    step = 1e-3
    for way in np.linspace(0.05, curve.length_m - 0.05, 37):
        before, here, after = (curve.at(way + k * step) for k in (-1, 0, 1))
        chord = np.subtract(after.position_table_m, before.position_table_m)
        assert np.hypot(*chord) == pytest.approx(2 * step, rel=1e-3)
        assert math.cos(math.atan2(chord[1], chord[0]) - here.direction_rad) == pytest.approx(1.0, abs=1e-5)
        if before.curvature_per_m == after.curvature_per_m or isinstance(curve, FigureEight):
            turned = math.remainder(after.direction_rad - before.direction_rad, math.tau) / (2 * step)
            assert turned == pytest.approx(here.curvature_per_m, abs=0.01)


@pytest.mark.parametrize("parameters", [PERIMETER, EIGHT])
def test_velocity_and_acceleration_are_those_of_the_places_all_the_way_round(parameters):
    places = flown("path", parameters, (0.0, -0.5), 200.0)[300:]
    speed = parameters.get("speed_m_s", 0.06)
    velocity = np.array([goal.velocity_table_m_s for goal in places])
    place = np.array([goal.position_table_m for goal in places])
    assert np.hypot(*velocity.T) == pytest.approx(np.full(len(velocity), speed))
    # central differences over two steps of 0.1 s
    assert (place[2:] - place[:-2]) / 0.2 == pytest.approx(velocity[1:-1], abs=1e-3)
    acceleration = np.array([goal.acceleration_table_m_s2 for goal in places])
    found = (velocity[2:] - velocity[:-2]) / 0.2
    assert np.median(np.abs(found - acceleration[1:-1])) < 1e-4
    assert np.hypot(*acceleration.T).max() <= 0.015 * (1 + 1e-9)


@pytest.mark.parametrize(
    ("parameters", "word"),
    [
        ({"shape": "perimeter"}, "size_m"),
        ({**PERIMETER, "size_m": (9.0, 1.0)}, "outside the part of the table"),
        ({**PERIMETER, "corner_radius_m": 0.05}, "tightest bend"),
        ({**PERIMETER, "corner_radius_m": 0.9}, "corner_radius_m"),
        ({**PERIMETER, "waypoints_m": [(0.0, 0.0)]}, "waypoints_m"),
        ({"waypoints_m": [(0.0, 0.0)], "size_m": (1.0, 1.0)}, "size_m"),
    ],
)
def test_curves_that_cannot_be_driven_are_refused(parameters, word):
    with pytest.raises(ValueError, match=word):
        make_controller("path", parameters, VEHICLE, TABLE)


def test_a_free_tumble_keeps_to_the_closed_solution_of_eulers_equations():
    """Authority: Jacobi's elliptic functions (Landau and Lifshitz, Mechanics, section 37)."""
    config = TumbleConfig(
        mode="free", inertia_ratios=(1.0, 1.4, 1.8), rates_deg_s=(2.0, 0.0, 3.0), span_s=300.0
    )
    times_s, rates = vertical_rates(config)
    i1, i2, i3 = config.inertia_ratios
    w1, w3 = math.radians(2.0), math.radians(3.0)
    double_energy, square = i1 * w1**2 + i3 * w3**2, (i1 * w1) ** 2 + (i3 * w3) ** 2
    assert square > double_energy * i2
    tau = times_s * math.sqrt((i3 - i2) * (square - double_energy * i1) / (i1 * i2 * i3))
    modulus = (i2 - i1) * (double_energy * i3 - square) / ((i3 - i2) * (square - double_energy * i1))
    _, _, dn, _ = ellipj(tau, modulus)
    assert rates == pytest.approx(math.sqrt((square - double_energy * i1) / (i3 * (i3 - i1))) * dn, abs=1e-7)


def test_a_constant_turn_begins_gently_and_drifts_until_the_edge_of_the_region():
    places = flown("tumble", {"rate_deg_s": 3.0, "drift_m_s": (0.05, 0.0)}, (1.0, 0.0), 60.0)
    assert places[0].rate_rad_s < math.radians(0.1)
    assert places[-1].rate_rad_s == pytest.approx(math.radians(3.0))
    assert places[-1].position_table_m == pytest.approx((1.8, 0.0), abs=0.006)
    assert places[-1].velocity_table_m_s == (0.0, 0.0)
    assert places[120].velocity_table_m_s == pytest.approx((0.05, 0.0))


@pytest.mark.parametrize(
    "parameters",
    [{"inertia_ratios": (1.0, 1.0, 3.0)}, {"rates_deg_s": (0.0, 0.0, 40.0)}, {"drift_m_s": (1.0, 0.0)}],
)
def test_what_no_body_does_is_refused(parameters):
    with pytest.raises(ValueError, match=next(iter(parameters))):
        make_controller("tumble", parameters, VEHICLE)
