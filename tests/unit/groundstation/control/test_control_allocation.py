"""Allocation against an independent linear programme, the envelope against its own definition."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from groundstation.control.allocation import MAX_VALVES, Allocator
from groundstation.control.state import BodyWrench
from groundstation.control.vehicle import Valve, VehicleModel, square_of_eight
from groundstation.control.wrench_envelope import WrenchEnvelope

SQUARE = VehicleModel(11.0, 0.25, square_of_eight())
# six valves in three tangential pairs at 120 degrees, of unlike thrust: no symmetry to lean on
HEXAGON = VehicleModel(
    9.0,
    0.2,
    tuple(
        Valve(
            (0.2 * math.cos(angle), 0.2 * math.sin(angle)),
            (-side * math.sin(angle), side * math.cos(angle)),
            0.2 + 0.03 * number,
        )
        for number, angle in enumerate((0.3, 0.3 + 2.1, 0.3 + 4.2))
        for side in (1.0, -1.0)
    ),
)
ALLOCATORS = [Allocator(SQUARE), Allocator(HEXAGON)]
demands = st.builds(BodyWrench, st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)), st.floats(-0.2, 0.2))


def made(allocator, duty):
    return allocator.effectiveness @ duty


def vector(wrench):
    return np.array((*wrench.force_body_n, wrench.torque_nm))


def test_the_usual_layout_is_the_one_on_the_data_sheet():
    columns = SQUARE.effectiveness()
    assert columns[:2].T.tolist() == [
        [0.22, 0], [0.22, 0], [-0.22, 0], [-0.22, 0], [0, 0.22], [0, 0.22], [0, -0.22], [0, -0.22],
    ]  # fmt: skip
    assert np.sign(columns[2]).tolist() == [-1, 1, 1, -1, 1, -1, -1, 1]
    assert np.abs(columns[2]) == pytest.approx(0.15 * 0.22)
    envelope = WrenchEnvelope(SQUARE)
    assert envelope.max_force_n / SQUARE.mass_kg == pytest.approx(0.04)  # a pair on 11 kg
    assert envelope.max_torque_nm == pytest.approx(4 * 0.15 * 0.22)


@pytest.mark.parametrize("allocator", ALLOCATORS)
@given(demand=demands, sparse=st.booleans())
def test_duties_make_the_demand_that_the_envelope_leaves(allocator, demand, sparse):
    duty = allocator.allocate(demand, sparse=sparse)
    assert (duty >= 0.0).all()
    assert (duty <= 1.0).all()
    assert made(allocator, duty) == pytest.approx(vector(allocator.envelope.saturate(demand)), abs=1e-7)


@pytest.mark.parametrize("allocator", ALLOCATORS)
def test_no_plan_burns_less_than_the_allocated_one(allocator):
    """Authority: scipy's HiGHS solver on the same programme."""
    rng = np.random.default_rng(7)
    for _ in range(150):
        demand = BodyWrench(tuple(rng.normal(0.0, 0.2, 2)), rng.normal(0.0, 0.04))
        # a little inside, where the solver's feasibility tolerance does not matter
        inside = 0.999 * vector(allocator.envelope.saturate(demand))
        best = linprog(allocator.flow, A_eq=allocator.effectiveness, b_eq=inside, bounds=(0.0, 1.0))
        assert best.status == 0
        for sparse in (False, True):
            duty = allocator.allocate(BodyWrench((inside[0], inside[1]), inside[2]), sparse=sparse)
            assert allocator.flow @ duty == pytest.approx(best.fun, abs=1e-6)


@given(demand=demands)
def test_a_mirrored_demand_opens_the_mirrored_valves(demand):
    allocator = ALLOCATORS[0]
    duty = allocator.allocate(demand)
    (force_x, force_y), torque = demand.force_body_n, demand.torque_nm
    # mirrored at the body x axis: valves at +y and -y, and pushes along +y and -y, change places
    mirrored = allocator.allocate(BodyWrench((force_x, -force_y), -torque))
    assert mirrored[[1, 0, 3, 2, 6, 7, 4, 5]] == pytest.approx(duty, abs=1e-7)


def test_gas_flows_in_proportion_to_thrust():
    assert ALLOCATORS[0].flow.tolist() == [1.0] * 8
    thrust = np.array([valve.thrust_n for valve in HEXAGON.valves])
    assert ALLOCATORS[1].flow == pytest.approx(thrust / thrust.mean())


def test_a_sparse_plan_for_a_push_along_one_axis_uses_its_pair_only():
    duty = ALLOCATORS[0].allocate(BodyWrench((0.1, 0.0), 0.0), sparse=True)
    assert np.flatnonzero(duty).tolist() == [0, 1]


def test_a_pure_turn_is_shared_by_all_four_couples_or_given_to_one():
    torque = BodyWrench((0.0, 0.0), 0.02)
    assert np.count_nonzero(ALLOCATORS[0].allocate(torque)) == 4
    assert np.count_nonzero(ALLOCATORS[0].allocate(torque, sparse=True)) == 2


@pytest.mark.parametrize("allocator", ALLOCATORS)
@given(demand=demands)
def test_saturation_keeps_the_direction_of_the_force_and_serves_torque_first(allocator, demand):
    envelope = allocator.envelope
    kept = envelope.saturate(demand)
    assert envelope.contains(kept)
    cross = kept.force_body_n[0] * demand.force_body_n[1] - kept.force_body_n[1] * demand.force_body_n[0]
    assert cross == pytest.approx(0.0, abs=1e-12)
    assert np.dot(kept.force_body_n, demand.force_body_n) >= 0.0
    limit = envelope.max_torque_nm
    if kept != demand:
        assert kept.torque_nm == pytest.approx(min(max(demand.torque_nm, -limit), limit))
        # and no force is given away: a thousandth more leaves the envelope
        more = BodyWrench((kept.force_body_n[0] * 1.001, kept.force_body_n[1] * 1.001), kept.torque_nm)
        whole = math.hypot(*kept.force_body_n) >= math.hypot(*demand.force_body_n) * (1 - 1e-9)
        assert whole or math.hypot(*kept.force_body_n) < 1e-6 or not envelope.contains(more)


@given(st.lists(st.floats(0.0, 1.0), min_size=8, max_size=8))
def test_whatever_valves_do_lies_in_the_envelope(duty):
    allocator = ALLOCATORS[0]
    force_x, force_y, torque = made(allocator, np.array(duty))
    assert allocator.envelope.contains(BodyWrench((force_x, force_y), torque))


def test_absurd_demands_are_made_finite():
    duty = ALLOCATORS[0].allocate(BodyWrench((1e308, -1e308), 0.0))
    assert made(ALLOCATORS[0], duty) == pytest.approx((0.44, -0.44, 0.0), abs=1e-6)


def test_valves_that_cannot_push_backwards_are_refused():
    forward_only = tuple(valve for valve in square_of_eight() if valve.direction_body != (-1.0, 0.0))
    with pytest.raises(ValueError, match="cannot push in every direction"):
        Allocator(VehicleModel(11.0, 0.25, forward_only))


def test_valves_on_one_line_are_refused():
    with pytest.raises(ValueError, match="one line"):
        Allocator(
            VehicleModel(
                11.0, 0.25, (Valve((0.1, 0.0), (1.0, 0.0), 0.2), Valve((0.1, 0.0), (-1.0, 0.0), 0.2))
            )
        )


def test_more_valves_than_the_method_is_made_for_are_refused():
    with pytest.raises(ValueError, match=f"at most {MAX_VALVES}"):
        Allocator(VehicleModel(11.0, 0.25, square_of_eight() * 2))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Valve((0.0, 0.0), (1.0, 1.0), 0.2), "length 1"),
        (lambda: Valve((0.0, 0.0), (1.0, 0.0), 0.0), "above 0 N"),
        (lambda: VehicleModel(0.0, 0.25, square_of_eight()), "mass and inertia"),
        (lambda: VehicleModel(11.0, 0.25, ()), "found none"),
    ],
)
def test_a_vehicle_that_cannot_be_is_refused(make, words):
    with pytest.raises(ValueError, match=words):
        make()
