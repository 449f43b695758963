"""Quantities of flights that are made by hand, with the right value in each."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.parts.scenario.conditions import Bounds
from groundstation.scenario.flight_log import VehicleTrack
from groundstation.scenario.quantities import QUANTITIES, every_quantity
from groundstation.scenario.run_tracks import Docks, Keeps, RunTracks, Span
from groundstation.watch.verdict import RunEvent

T = np.arange(0.0, 20.0, 0.05)


def rows(*columns):
    return np.column_stack([np.broadcast_to(column, T.shape) for column in columns])


def track(x, y=0.0, heading=0.0, setpoint=(0.0, 0.0, 0.0), goals=(), state=None, has_truth=True):
    speed = np.gradient(np.broadcast_to(x, T.shape), T)
    truth = rows(T, x, y, heading, speed, 0.0)
    return VehicleTrack(
        truth,
        truth if state is None else state,
        np.column_stack([T[::4], *[np.broadcast_to(value, T[::4].shape) for value in setpoint]]),
        np.array([[1.0, 0.02], [2.0, 0.04], [15.0, 0.02]]),
        np.array(goals, float).reshape(-1, 4),
        has_truth,
    )


def flown(alpha, beta=None, events=(), obstacles=(), keeps=None):
    tracks = {"alpha": alpha} if beta is None else {"alpha": alpha, "beta": beta}
    bounds = Bounds((-2.0, 2.0), (-1.5, 1.5))
    return RunTracks(
        tracks, tuple(events), bounds, tuple(obstacles), dict.fromkeys(tracks, 0.22), keeps or {}, 20.0
    )


def value(seen, what, *vehicles, span=(0.0, 20.0)):
    return QUANTITIES[what].of(seen, vehicles or ("alpha",), Span(*span))


def test_position_and_heading_errors_are_to_the_setpoint():
    seen = flown(track(np.where(T < 10.0, 0.003, 0.004), heading=math.radians(0.5), setpoint=(0.0, 0.0, 0.0)))
    assert value(seen, "position_error_rms_mm", span=(0.0, 9.9)).value == pytest.approx(3.0)
    largest = value(seen, "position_error_max_mm")
    assert (largest.value, largest.at_s) == (pytest.approx(4.0), pytest.approx(10.0))
    assert value(seen, "heading_error_rms_deg").value == pytest.approx(0.5)


def test_a_setpoint_that_moves_is_followed_between_its_reports():
    moving = 0.06 * T
    seen = flown(track(moving, setpoint=(moving[::4], 0.0, 0.0)))
    assert value(seen, "position_error_max_mm", span=(0.0, 19.0)).value == pytest.approx(0.0, abs=1e-9)


def test_a_setpoint_that_jumps_is_not_smeared():
    jumps = np.where(T < 10.0, 0.0, 1.0)
    seen = flown(track(jumps, setpoint=(np.where(T[::4] < 10.0, 0.0, 1.0), 0.0, 0.0)))
    assert value(seen, "position_error_max_mm", span=(0.0, 9.7)).value == pytest.approx(0.0, abs=1e-9)


def test_settling_is_from_the_goal_to_where_three_seconds_of_rest_begin():
    x = np.where(T < 6.0, 0.5 * np.minimum(T - 2.0, 4.0).clip(0.0) / 4.0, 0.5)
    seen = flown(track(x, setpoint=(0.5, 0.0, 0.0), goals=[(2.0, 0.5, 0.0, 0.0)]))
    found = value(seen, "settling_s")
    assert found.value == pytest.approx(4.0, abs=0.11)
    assert found.at_s == pytest.approx(6.0, abs=0.11)
    assert value(seen, "settling_s", span=(0.0, 8.0)).value == math.inf


def test_overshoot_is_beyond_the_goal_along_the_way():
    x = np.interp(T, [0.0, 5.0, 6.0, 8.0, 20.0], [0.0, 1.0, 1.013, 1.0, 1.0])
    seen = flown(track(x, setpoint=(1.0, 0.0, 0.0), goals=[(0.0, 1.0, 0.0, 0.0)]))
    assert value(seen, "overshoot_mm").value == pytest.approx(13.0)
    short = flown(track(0.9 * x, setpoint=(1.0, 0.0, 0.0), goals=[(0.0, 1.0, 0.0, 0.0)]))
    assert value(short, "overshoot_mm").value == 0.0
    assert math.isnan(value(flown(track(x)), "overshoot_mm").value)


def test_gas_is_open_time_times_thrust_within_the_span():
    assert value(flown(track(0.0)), "gas_ns").value == pytest.approx(0.08 * 0.22)
    assert value(flown(track(0.0)), "gas_ns", span=(0.0, 10.0)).value == pytest.approx(0.06 * 0.22)


def test_margins_are_from_hull_to_edge_obstacle_and_hull():
    seen = flown(track(1.5), track(0.5), obstacles=[(1.5, 0.6, 0.15)])
    assert value(seen, "least_edge_mm").value == pytest.approx(300.0)
    assert value(seen, "least_obstacle_mm").value == pytest.approx(250.0)
    assert value(seen, "least_distance_mm", "alpha", "beta").value == pytest.approx(600.0)
    assert value(seen, "contacts").value == 0.0


def test_contacts_count_how_often_a_hull_came_to_touch():
    x = np.where((T > 5.0) & (T < 6.0) | (T > 10.0), 1.81, 0.0)
    found = value(flown(track(x)), "contacts")
    assert found.value == 2.0
    assert found.at_s == pytest.approx(5.05)
    assert value(flown(track(0.0), track(0.39)), "contacts").value == 1.0


def test_followers_keep_distance_and_face_their_leader():
    keeps = {"alpha": Keeps("beta", 1.0, faces=True)}
    seen = flown(track(0.0, heading=math.radians(2.0)), track(1.01), keeps=keeps)
    assert value(seen, "distance_error_rms_mm").value == pytest.approx(10.0)
    assert value(seen, "pointing_error_rms_deg").value == pytest.approx(2.0)
    columns = dict(every_quantity(seen))
    assert "alpha.distance_error_rms_mm" in columns
    assert "beta.distance_error_rms_mm" not in columns
    assert "alpha-beta.least_distance_mm" in columns


def test_the_estimate_is_compared_with_truth_and_unknown_without():
    truth = track(0.1)
    state = truth.truth + np.array([0.0, 0.003, 0.004, 0.0, 0.0, 0.0])
    seen = flown(track(0.1, state=state))
    assert value(seen, "estimate_error_rms_mm").value == pytest.approx(5.0)
    assert math.isnan(value(flown(track(0.1, has_truth=False)), "estimate_error_max_mm").value)


def test_faults_are_counted_in_the_span():
    events = [
        RunEvent(3.0, "fault", "alpha", "star_outage: no fix"),
        RunEvent(4.0, "fault", "alpha", "star_outage ends"),
        RunEvent(5.0, "fault", "beta", "pushed"),
    ]
    found = value(flown(track(0.0), track(1.0), events), "faults")
    assert (found.value, found.at_s) == (1.0, 3.0)


@pytest.mark.parametrize("what", QUANTITIES)
def test_nothing_flown_is_unknown_or_nothing_and_no_error(what):
    empty = VehicleTrack(*(np.empty((0, n)) for n in (6, 6, 4, 2, 4)), has_truth=False)
    pair = ("alpha", "beta") if QUANTITIES[what].is_of_pair else ("alpha",)
    found = value(flown(empty, empty), what, *pair)
    assert math.isnan(found.value) or found.value == 0.0


def docking(beta):
    """Beta and alpha, which stands at the origin; its port looks along +x."""
    seen = flown(track(0.0 * T, heading=math.pi / 2), beta)
    return replace(seen, docks={"beta": Docks("alpha", -math.pi / 2, 0.4)})


def test_first_contact_is_measured_before_the_bumper_changes_it():
    coming_in = np.where(T < 10.0, 0.4 + 0.008 * (10.0 - T), 0.4 + 0.004 * (T - 10.0))
    seen = docking(track(coming_in, y=0.003))
    speed = value(seen, "contact_speed_mm_s", "beta")
    assert speed.value == pytest.approx(8.0, abs=0.1)
    assert speed.at_s == pytest.approx(10.0, abs=0.1)
    lateral = value(seen, "contact_lateral_mm", "beta")
    assert lateral.value == pytest.approx(3.0)
    assert lateral.at_s == speed.at_s
    assert {"beta.contact_speed_mm_s", "beta.contact_lateral_mm"} <= dict(every_quantity(seen)).keys()
    assert "alpha.contact_speed_mm_s" not in dict(every_quantity(seen))


def test_who_never_touches_has_no_soft_contact():
    seen = docking(track(0.402 + 0.0 * T))
    assert math.isinf(value(seen, "contact_speed_mm_s", "beta").value)
    assert math.isinf(value(seen, "contact_lateral_mm", "beta").value)


def test_who_docks_with_nobody_has_none():
    assert math.isnan(value(flown(track(0.0 * T), track(0.5 + 0.0 * T)), "contact_speed_mm_s", "beta").value)
