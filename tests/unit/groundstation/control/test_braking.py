"""Braking to rest and holding there, against a table that pulls; dead reckoning where no state comes."""

import math

import numpy as np
import pytest

from groundstation.control.brake import BrakeConfig, brake_wrench, dead_reckoned
from groundstation.control.braking import Braking
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState, Goal, rotate
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope

MODEL = VehicleModel(11.0, 0.25, square_of_eight())
ENVELOPE = WrenchEnvelope(MODEL)
PERIOD_NS = 100_000_000
SLOPE_M_S2 = np.array((0.004, -0.002))


def make():
    return Braking(BrakeConfig(), MODEL, ENVELOPE, PERIOD_NS)


def fly(braking, position, velocity, seconds, *, place=None, pushed_at=None):
    """A mock-up on a slope whose pulses give what is asked; yields the true position each period."""
    p, v, heading, rate = np.array(position), np.array(velocity), 0.4, 0.1
    for period in range(round(seconds * 10)):
        now_ns = period * PERIOD_NS
        if period == pushed_at:
            v = np.add(v, (0.1, 0.0))
        braking.take(ControlState(tuple(p), tuple(v), heading, rate), now_ns)
        wrench = braking.wrench(now_ns) if place is None else braking.wrench(now_ns, place)
        braking.deliver(wrench)
        a = np.array(rotate(wrench.force_body_n, heading)) / MODEL.mass_kg + SLOPE_M_S2
        p, v = p + 0.1 * v + 0.005 * a, v + 0.1 * a
        heading, rate = heading + 0.1 * rate, rate + 0.1 * wrench.torque_nm / MODEL.inertia_kg_m2
        yield p


def test_without_a_state_there_is_nothing_to_brake_on():
    assert make().wrench(0) is None


def test_while_it_moves_it_is_the_brake_law():
    state = ControlState((0.3, 0.2), (0.05, -0.02), 0.7, 0.4)
    braking = make()
    braking.take(state, 0)
    assert braking.wrench(PERIOD_NS) == brake_wrench(state, BrakeConfig(), MODEL, ENVELOPE)
    assert braking.held is None


def test_at_rest_the_place_is_held_on_a_slope():
    braking = make()
    places = list(fly(braking, (0.0, 0.0), (0.08, 0.02), 90.0))
    held = np.array(braking.held.position_table_m)
    assert np.linalg.norm(places[-1] - held) < 0.004
    assert max(np.linalg.norm(place - held) for place in places[300:]) < 0.03


def test_the_place_to_hold_may_be_another_one():
    braking = make()
    *_, last = fly(braking, (0.0, 0.0), (0.02, 0.0), 90.0, place=lambda position, now_ns: (0.3, 0.1))
    assert last == pytest.approx((0.3, 0.1), abs=0.005)


def test_a_push_is_braked_before_a_place_is_held_again():
    braking = make()
    places = list(fly(braking, (0.0, 0.0), (0.0, 0.0), 120.0, pushed_at=300))
    held = np.array(braking.held.position_table_m)
    assert held[0] > 0.05  # not the place from which it was pushed
    assert np.linalg.norm(places[-1] - held) < 0.004


@pytest.mark.parametrize(
    ("speed_m_s", "rate_deg_s", "is_held"),
    [(0.007, 1.9, True), (0.009, 0.0, False), (0.0, 2.1, False)],
)
def test_what_counts_as_rest(speed_m_s, rate_deg_s, is_held):
    braking = make()
    braking.take(ControlState((0.1, 0.2), (0.0, speed_m_s), 0.3, math.radians(rate_deg_s)), 0)
    braking.wrench(0)
    assert (braking.held is not None) is is_held
    if is_held:
        assert (braking.held.position_table_m, braking.held.heading_rad) == ((0.1, 0.2), 0.3)


@pytest.mark.parametrize(
    ("speed_m_s", "rate_deg_s", "is_held"),
    [(0.039, 7.9, True), (0.041, 0.0, False), (0.0, 8.1, False)],
)
def test_what_counts_as_pushed(speed_m_s, rate_deg_s, is_held):
    braking = make()
    braking.take(ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0), 0)
    braking.wrench(0)
    braking.take(ControlState((0.0, 0.0), (speed_m_s, 0.0), 0.0, math.radians(rate_deg_s)), PERIOD_NS)
    braking.wrench(PERIOD_NS)
    assert (braking.held is not None) is is_held


def test_begun_anew_it_holds_where_it_is_then():
    braking = make()
    braking.take(ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0), 0)
    braking.wrench(0)
    braking.begin()
    braking.take(ControlState((0.5, 0.0), (0.0, 0.0), 0.0, 0.0), PERIOD_NS)
    braking.wrench(PERIOD_NS)
    assert braking.held.position_table_m == (0.5, 0.0)


def test_without_new_states_it_reckons_and_holds_nothing():
    braking = make()
    state = ControlState((0.0, 0.0), (0.001, 0.0), 0.0, 0.0)
    braking.take(state, 0)
    braking.wrench(0)
    assert braking.held is not None
    delivered = BodyWrench((0.1, 0.0), 0.0)
    braking.deliver(delivered)
    found = braking.wrench(PERIOD_NS + 1)
    reckoned = dead_reckoned(state, delivered, 0.1, MODEL)
    assert braking.held is None
    assert braking.state == reckoned
    assert found == brake_wrench(reckoned, BrakeConfig(), MODEL, ENVELOPE)
    braking.deliver(NO_WRENCH)
    braking.wrench(2 * PERIOD_NS)
    assert braking.state.position_table_m[0] > reckoned.position_table_m[0]


@pytest.mark.parametrize(
    ("speed_m_s", "rate_deg_s", "is_held"),
    [(0.0079, 0.0, True), (0.008, 0.0, False), (0.0, 1.95, True), (0.0, 2.0, False), (0.0, -2.05, False)],
)
def test_the_limits_of_rest(speed_m_s, rate_deg_s, is_held):
    braking = make()
    braking.take(ControlState((0.1, 0.2), (0.0, speed_m_s), 0.3, math.radians(rate_deg_s)), 0)
    braking.wrench(0)
    assert (braking.held is not None) is is_held


@pytest.mark.parametrize(
    ("speed_m_s", "rate_deg_s", "is_held"),
    [(0.04, 8.0, True), (0.0405, 0.0, False), (0.0, 8.05, False), (0.0, -8.05, False), (0.039, 7.95, True)],
)
def test_the_limits_of_what_counts_as_pushed(speed_m_s, rate_deg_s, is_held):
    braking = make()
    braking.take(ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0), 0)
    braking.wrench(0)
    braking.take(ControlState((0.0, 0.0), (speed_m_s, 0.0), 0.0, math.radians(rate_deg_s)), PERIOD_NS)
    braking.wrench(PERIOD_NS)
    assert (braking.held is not None) is is_held


def test_a_held_place_is_kept_by_a_station_that_begins_anew_and_is_told_what_was_delivered():
    """Twice: rest, a force beside the pulses, a push; the second time as if there had been no first."""
    braking = make()
    delivered = BodyWrench((0.05, -0.03), 0.002)
    for round_ in range(2):
        station = StationKeeping(StationConfig(), MODEL)
        begin_ns = 10 * round_ * PERIOD_NS
        for step in range(4):
            state = ControlState((0.1 + 0.01 * step, 0.2), (0.002 * step, 0.0), 0.3, 0.01 * step)
            braking.deliver(delivered)
            braking.take(state, begin_ns + step * PERIOD_NS)
            found = braking.wrench(begin_ns + step * PERIOD_NS)
            assert braking.held == Goal((0.1, 0.2), 0.3)
            assert found == station.update(state, braking.held, 0.1, applied=delivered)
        braking.take(ControlState((0.0, 0.0), (0.2, 0.0), 0.0, 0.0), begin_ns + 5 * PERIOD_NS)
        braking.wrench(begin_ns + 5 * PERIOD_NS)
        assert braking.held is None


def test_before_anything_was_delivered_nothing_was():
    braking = make()
    state = ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0)
    braking.take(state, 0)
    braking.wrench(PERIOD_NS + 1)
    assert braking.state == state


def test_where_to_hold_is_asked_with_place_and_time():
    braking, asked = make(), []
    braking.take(ControlState((0.1, 0.2), (0.0, 0.0), 0.0, 0.0), 7)
    braking.wrench(9, lambda position, now_ns: asked.append((position, now_ns)) or (0.5, 0.6))
    assert asked == [((0.1, 0.2), 9)]
    assert braking.held.position_table_m == (0.5, 0.6)
