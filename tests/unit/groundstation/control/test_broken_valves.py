"""Allocation and envelope with valves that failed: random layouts, random failures, an independent solver."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from groundstation.control.allocation import Allocator
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.state import NO_WRENCH, BodyWrench
from groundstation.control.valve_health import (
    HEALTHY,
    STUCK_CLOSED,
    ValveHealth,
    leaking,
    stuck_open,
    weak,
)
from groundstation.control.vehicle import Valve, VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope

SQUARE = VehicleModel(11.0, 0.25, square_of_eight())
ALLOCATOR = Allocator(SQUARE)
MODULATOR = PulseModulator(ALLOCATOR, PulseConfig())
FAR = BodyWrench((3.0, -2.0), 1.0)

demands = st.builds(BodyWrench, st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)), st.floats(-0.2, 0.2))
states = st.one_of(
    st.just(HEALTHY),
    st.just(STUCK_CLOSED),
    st.builds(stuck_open, st.floats(0.1, 1.0)),
    st.builds(weak, st.floats(0.1, 0.9)),
    st.builds(leaking, st.floats(0.02, 0.6)),
)
of_square = st.lists(states, min_size=8, max_size=8)


@st.composite
def broken_vehicles(draw):
    """Any layout that healthy valves can fly, and any failures of it."""
    count = draw(st.integers(4, 10))
    seed = draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    turns = rng.uniform(0.0, 2.0 * math.pi, count)
    valves = tuple(
        Valve(tuple(place), (math.cos(turn), math.sin(turn)), float(thrust))
        for place, turn, thrust in zip(
            rng.uniform(-0.25, 0.25, (count, 2)).tolist(),
            turns.tolist(),
            rng.uniform(0.1, 0.4, count).tolist(),
            strict=True,
        )
    )
    vehicle = VehicleModel(11.0, 0.25, valves)
    try:
        whole = Allocator(vehicle)
    except ValueError:
        assume(False)
    return whole, draw(st.lists(states, min_size=count, max_size=count))


def vector(wrench):
    return np.array((*wrench.force_body_n, wrench.torque_nm))


def made(allocator, duty):
    return allocator.effectiveness @ duty + allocator.offset


def only(valve, state):
    return [state if one == valve else HEALTHY for one in range(8)]


def check_duties(allocator, demand, *, sparse):
    duty = allocator.allocate(demand, sparse=sparse)
    assert (duty >= 0.0).all()
    assert (duty <= 1.0).all()
    assert not duty[[not obeys for obeys in allocator.obeys]].any()
    kept = allocator.envelope.saturate(demand)
    assert made(allocator, duty) == pytest.approx(vector(kept), abs=1e-6)
    if allocator.envelope.contains(demand, -1e-9):
        assert kept == demand
    return duty


@given(of_square, demands, st.booleans())
@settings(max_examples=100)
def test_duties_make_what_is_left_of_the_demand_whatever_failed(health, demand, sparse):
    check_duties(ALLOCATOR.with_health(health), demand, sparse=sparse)


@given(broken_vehicles(), demands, st.booleans())
@settings(max_examples=100)
def test_so_they_do_in_any_layout(broken, demand, sparse):
    whole, health = broken
    check_duties(whole.with_health(health), demand, sparse=sparse)


def least_gas(allocator, wrench):
    """Authority: scipy's HiGHS solver on the same programme."""
    return linprog(
        allocator.flow,
        A_eq=allocator.effectiveness,
        b_eq=vector(wrench) - allocator.offset,
        bounds=(0.0, 1.0),
        options={"primal_feasibility_tolerance": 1e-9, "dual_feasibility_tolerance": 1e-9},
    )


@given(broken_vehicles(), demands)
@settings(max_examples=100)
def test_no_plan_of_the_valves_that_are_left_burns_less(broken, demand):
    whole, health = broken
    allocator = whole.with_health(health)
    # what some duties make, so that no rounding of the envelope's surface decides
    reached = allocator.envelope.saturate(demand)
    best = least_gas(allocator, reached)
    assume(best.status == 0)
    for sparse in (False, True):
        duty = allocator.allocate(reached, sparse=sparse)
        assert allocator.flow @ duty == pytest.approx(best.fun, abs=1e-6)


@given(broken_vehicles(), demands)
@settings(max_examples=100)
def test_the_envelope_says_what_the_solver_says(broken, demand):
    whole, health = broken
    allocator = whole.with_health(health)
    is_makeable = least_gas(allocator, demand).status == 0
    if allocator.envelope.contains(demand, -1e-6):
        assert is_makeable
    elif not allocator.envelope.contains(demand, 1e-6):
        assert not is_makeable


@given(broken_vehicles())
@settings(max_examples=40)
def test_largest_force_and_torque_can_be_made_and_a_little_more_cannot(broken):
    whole, health = broken
    envelope = whole.with_health(health).envelope
    assert envelope.can_rest == envelope.contains(NO_WRENCH)
    angles = np.linspace(0.0, 2.0 * math.pi, 180, endpoint=False)

    def all_round(force_n):
        return [
            envelope.contains(BodyWrench((force_n * math.cos(angle), force_n * math.sin(angle)), 0.0))
            for angle in angles
        ]

    if envelope.max_force_n > 0.0:
        assert all(all_round(envelope.max_force_n))
    if envelope.can_rest:
        assert not all(all_round(1.001 * envelope.max_force_n + 1e-6))
        more = 1.001 * envelope.max_torque_nm + 1e-6
        assert not all(envelope.contains(BodyWrench((0.0, 0.0), sign * more)) for sign in (-1.0, 1.0))
    for sign in (-1.0, 1.0):
        if envelope.max_torque_nm > 0.0:
            assert envelope.contains(BodyWrench((0.0, 0.0), sign * envelope.max_torque_nm))
    if not envelope.missing:
        assert envelope.max_force_n > 0.0
        assert envelope.max_torque_nm > 0.0


@given(of_square, demands)
def test_saturation_serves_torque_first_and_keeps_the_direction_where_the_valves_can_rest(health, demand):
    envelope = ALLOCATOR.with_health(health).envelope
    assume(envelope.can_rest)
    kept = envelope.saturate(demand)
    assert envelope.contains(kept)
    cross = kept.force_body_n[0] * demand.force_body_n[1] - kept.force_body_n[1] * demand.force_body_n[0]
    assert cross == pytest.approx(0.0, abs=1e-9)
    assert np.dot(kept.force_body_n, demand.force_body_n) >= 0.0
    if abs(kept.torque_nm - demand.torque_nm) > 1e-9:
        sign = math.copysign(1e-6, demand.torque_nm - kept.torque_nm)
        assert not envelope.contains(BodyWrench((0.0, 0.0), kept.torque_nm + sign))


@given(demands)
def test_a_thrust_that_nothing_cancels_is_left_as_near_to_the_demand_as_can_be(demand):
    """Valve 0 is open for good, and what pushes against it is closed."""
    health = [stuck_open(), HEALTHY, STUCK_CLOSED, STUCK_CLOSED, *[HEALTHY] * 4]
    envelope = ALLOCATOR.with_health(health).envelope
    assert not envelope.can_rest
    assert envelope.max_force_n == envelope.max_torque_nm == 0.0
    kept = envelope.saturate(demand)
    assert envelope.contains(kept)
    # its four couples can turn by 0.066 about the 0.033 of the valve and give or take the other valve's
    assert kept.torque_nm == pytest.approx(min(max(demand.torque_nm, -0.099), 0.066))
    assert 0.22 - 1e-9 <= kept.force_body_n[0] <= 0.44 + 1e-9
    distance = math.dist(kept.force_body_n, demand.force_body_n)
    rng = np.random.default_rng(3)
    columns = SQUARE.effectiveness()
    for _ in range(50):
        duty = rng.uniform(0.0, 1.0, 8)
        duty[[0, 2, 3]] = 1.0, 0.0, 0.0
        force_x, force_y, torque = columns @ duty
        if abs(torque - kept.torque_nm) < 1e-3:
            assert math.dist((force_x, force_y), demand.force_body_n) > distance - 0.02


def test_one_valve_out_leaves_half_the_weakest_force_and_half_the_torque():
    whole = ALLOCATOR.envelope
    for valve in range(8):
        for state in (STUCK_CLOSED, stuck_open()):
            left = ALLOCATOR.with_health(only(valve, state)).envelope
            assert left.missing == ""
            assert left.max_force_n == pytest.approx(0.5 * whole.max_force_n)
            assert left.max_torque_nm == pytest.approx(0.5 * whole.max_torque_nm)


def test_a_valve_that_is_stuck_open_is_cancelled_by_the_opposite_one():
    duty = ALLOCATOR.with_health(only(0, stuck_open(0.6))).allocate(NO_WRENCH)
    assert duty == pytest.approx([0, 0, 0.6, 0, 0, 0, 0, 0])


def test_what_is_left_is_described_in_words():
    words = {
        "nothing acts along (force x, force y, torque) = [-1.0, 0.0, 0.0]": [2, 3],
        "they all push along one line": [1, 2, 3, 4, 5, 6, 7],
        "none of them obeys": range(8),
    }
    for wanted, out in words.items():
        envelope = WrenchEnvelope(SQUARE, [STUCK_CLOSED if one in out else HEALTHY for one in range(8)])
        assert envelope.missing == wanted
        assert envelope.can_rest
    health = [stuck_open(), HEALTHY, STUCK_CLOSED, STUCK_CLOSED, *[HEALTHY] * 4]
    assert WrenchEnvelope(SQUARE, health).missing == (
        "something always pushes against (force x, force y, torque) = [-1.0, 0.0, 0.0]"
    )


def test_without_any_valve_nothing_is_allocated():
    allocator = ALLOCATOR.with_health([STUCK_CLOSED] * 8)
    assert not allocator.allocate(FAR).any()
    assert allocator.envelope.saturate(FAR) == NO_WRENCH


def test_health_that_came_back_plans_as_before():
    again = ALLOCATOR.with_health([STUCK_CLOSED] * 8).with_health(None)
    for demand in (FAR, BodyWrench((0.1, 0.05), 0.01), NO_WRENCH):
        assert (again.allocate(demand) == ALLOCATOR.allocate(demand)).all()
        assert (again.allocate(demand, sparse=True) == ALLOCATOR.allocate(demand, sparse=True)).all()


@settings(max_examples=40)
@given(of_square, st.lists(demands, min_size=1, max_size=12), st.sampled_from([1.0, 0.97]))
def test_no_command_opens_a_valve_that_does_not_obey(health, sequence, sag):
    modulator = PulseModulator(ALLOCATOR, PulseConfig(sag=sag))
    modulator.update(FAR)  # some valves stay open into the period in which they are found to be stuck
    modulator.take_health(health)
    for demand in sequence:
        on = modulator.update(demand).on_time_ms
        assert not any(ms for ms, valve in zip(on, health, strict=True) if not valve.obeys)


@given(of_square, st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)), st.floats(-0.01, 0.01))
@settings(max_examples=25)
def test_on_average_broken_valves_deliver_the_demand_too(health, force, torque):
    demand, periods = BodyWrench(force, torque), 150
    modulator = PulseModulator(ALLOCATOR, PulseConfig())
    modulator.take_health(health)
    envelope = modulator.allocator.envelope
    assume(envelope.contains(demand, -0.02))  # so much is left on every side
    mean = sum(vector(modulator.update(demand).delivered) for _ in range(periods)) / periods
    carried = 3 * 0.010 * np.array((0.22, 0.22, 0.033)) / (periods * 0.1)
    assert (np.abs(mean - vector(demand)) <= carried + 1e-9).all()


def test_a_stuck_valves_thrust_and_gas_are_counted():
    modulator = PulseModulator(ALLOCATOR, PulseConfig())
    modulator.take_health(only(0, stuck_open(0.5)))
    first = modulator.update(BodyWrench((0.11, 0.0), -0.0165))
    assert first.on_time_ms == (0,) * 8
    assert vector(first.delivered) == pytest.approx([0.11, 0.0, -0.0165])
    assert first.open_valve_s == pytest.approx(0.05)


@pytest.mark.parametrize(("open_share", "shut_share"), [(0.5, 0.6), (2.5, 0.0), (1.0, -0.1), (math.nan, 0.0)])
def test_health_that_cannot_be_is_refused(open_share, shut_share):
    with pytest.raises(ValueError, match="shares of thrust must be"):
        ValveHealth(open_share, shut_share)


def test_health_of_another_number_of_valves_is_refused():
    with pytest.raises(ValueError, match="each of 8 valves needs a state of health, found 7"):
        ALLOCATOR.with_health([HEALTHY] * 7)
