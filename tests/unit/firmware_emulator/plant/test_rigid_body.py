import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_emulator.plant.air_table import GRAVITY_M_S2, FloorPulses, Surface
from firmware_emulator.plant.body import Body
from firmware_emulator.plant.contacts import Contacts
from firmware_emulator.plant.motion_state import Motion, PollGrid
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import GasSupply, Nozzle, ThrusterBank, ValveTiming

MS = 1_000_000
S = 1_000_000_000
LEVEL = (0.0, 0.0)
NOZZLES = [
    Nozzle((-0.15, 0.15), (1.0, 0.0), 0.22),
    Nozzle((-0.15, -0.15), (1.0, 0.0), 0.22),
    Nozzle((0.15, 0.15), (-1.0, 0.0), 0.22),
    Nozzle((0.15, -0.15), (0.0, 1.0), 0.22),
]
RESTING = Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def vehicle(origin=RESTING, tilt=LEVEL, waviness=0.0, floating=True, body=None, shocks_hz=0.0, clock_ppm=0.0):
    body = body or Body()
    thrusters = ThrusterBank(
        NOZZLES, body.centre_of_mass_body_m, ValveTiming(open_sd_s=0.0), GasSupply(), np.random.default_rng(1)
    )
    surface = Surface(tilt, waviness, 0.8, np.random.default_rng(2))
    floor = FloorPulses(shocks_hz, 0.02, 0.06, np.random.default_rng(3))
    return Vehicle(body, origin, thrusters, surface, floor, 0.3, floating, PollGrid(0, clock_ppm))


def felt(one):
    return np.array(one.take_felt())


def energy_j(motion, body):
    return 0.5 * body.mass_kg * (motion.vx_m_s**2 + motion.vy_m_s**2) + 0.5 * body.inertia_kg_m2 * (
        motion.rate_rad_s**2
    )


def test_an_unpushed_vehicle_keeps_momentum_and_energy():
    one = vehicle(Motion(0.1, 0.2, 0.3, 0.05, -0.02, 0.4))
    one.advance(20 * S)
    assert one.motion.x_m == pytest.approx(0.1 + 20 * 0.05, abs=1e-12)
    assert one.motion.heading_rad == pytest.approx(0.3 + 20 * 0.4, abs=1e-12)
    assert energy_j(one.motion, one.body) == pytest.approx(
        energy_j(Motion(0, 0, 0, 0.05, -0.02, 0.4), one.body), rel=1e-12
    )


def test_a_landed_vehicle_rests_although_the_table_is_tilted_and_valves_blow():
    one = vehicle(tilt=(3e-4, -2e-4), floating=False)
    one.thrusters.energise(0, 0)
    one.advance(2 * S)
    assert one.motion == RESTING
    polls = felt(one)
    assert polls.shape == (2000, 3)
    np.testing.assert_allclose(polls[:, 1], GRAVITY_M_S2 * 3e-4, rtol=1e-12)  # up the slope
    np.testing.assert_allclose(polls[:, 2], -GRAVITY_M_S2 * 2e-4, rtol=1e-12)


def test_a_gliding_vehicle_runs_downhill_and_feels_no_slope():
    one = vehicle(tilt=(3e-4, 0.0))
    one.advance(2 * S)
    assert one.motion.x_m == pytest.approx(-0.5 * GRAVITY_M_S2 * 3e-4 * 4.0, rel=1e-9)
    np.testing.assert_array_equal(felt(one), 0.0)


def test_energy_is_kinetic_plus_height_on_a_wavy_table():
    one = vehicle(Motion(0.0, 0.0, 0.0, 0.1, 0.05, 0.0), waviness=2e-4)
    surface = Surface(LEVEL, 2e-4, 0.8, np.random.default_rng(2))
    start, work_j = energy_j(one.motion, one.body), 0.0
    for step in range(1000):
        before = one.motion
        one.advance((step + 1) * 10 * MS)
        gx, gy = surface.gradient(0.5 * (before.x_m + one.motion.x_m), 0.5 * (before.y_m + one.motion.y_m))
        climbed_m = gx * (one.motion.x_m - before.x_m) + gy * (one.motion.y_m - before.y_m)
        work_j -= one.body.mass_kg * GRAVITY_M_S2 * climbed_m
    gained_j = energy_j(one.motion, one.body) - start
    assert abs(gained_j) > 1e-3
    assert gained_j == pytest.approx(work_j, rel=0.02)


def test_motion_under_thrust_agrees_with_small_steps():
    """Against Runge-Kutta steps of 20 us on the equations of motion, spinning at 1 rad/s."""
    body = Body(centre_of_mass_body_m=(0.01, -0.02), drag_n_s_m=0.002, drag_nm_s=1e-5)
    one = vehicle(Motion(0.0, 0.0, 0.0, 0.02, 0.0, 1.0), tilt=(1e-4, 0.0), body=body)
    start = one.motion
    schedule = [(0, "energise", 0), (0, "energise", 3), (60 * MS, "release", 0), (110 * MS, "release", 3)]
    for stamp_ns, verb, valve in schedule:
        one.advance(stamp_ns)
        getattr(one.thrusters, verb)(stamp_ns, valve)
    one.advance(250 * MS)

    wrenches = [np.array(NOZZLES[valve].wrench(body.centre_of_mass_body_m)) for valve in (0, 3)]
    spans_s = [(0.006, 0.065), (0.006, 0.115)]

    def wrench(t_s):
        total = np.zeros(3)
        both = sum(start <= t_s < end for start, end in spans_s)
        for valve, (start, end) in zip(wrenches, spans_s, strict=True):
            if start <= t_s < end:
                total += valve * 0.97 ** max(0, both - 1)
        return total

    h_s, rise_s = 2e-5, 0.004
    state = np.array([start.x_m, start.y_m, 0.0, start.vx_m_s, start.vy_m_s, 1.0, 0.0, 0.0, 0.0])

    def slope(t_s, s):
        force = s[6:9]
        c, sn = math.cos(s[2]), math.sin(s[2])
        ax = (c * force[0] - sn * force[1] - 0.002 * s[3]) / 11.0 - GRAVITY_M_S2 * 1e-4
        ay = (sn * force[0] + c * force[1] - 0.002 * s[4]) / 11.0
        turn = (force[2] - 1e-5 * s[5]) / 0.25
        return np.concatenate([s[3:6], [ax, ay, turn], (wrench(t_s) - force) / rise_s])

    for step in range(12500):
        t_s = (step + 1e-6) * h_s
        k1 = slope(t_s, state)
        k2 = slope(t_s + 0.4999 * h_s, state + 0.5 * h_s * k1)
        state = state + h_s * k2
    got = one.motion
    np.testing.assert_allclose(
        [got.x_m, got.y_m, got.heading_rad, got.vx_m_s, got.vy_m_s, got.rate_rad_s], state[:6], atol=3e-7
    )


def test_the_imu_off_centre_feels_the_spin():
    body = Body(centre_of_mass_body_m=(0.01, 0.0), imu_body_m=(0.04, -0.02))
    one = vehicle(Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.8), body=body)
    one.advance(100 * MS)
    polls = felt(one)
    np.testing.assert_allclose(polls[:, 1], -(0.8**2) * 0.03, rtol=1e-12)
    np.testing.assert_allclose(polls[:, 2], 0.8**2 * 0.02, rtol=1e-12)


def test_what_the_imu_feels_integrates_to_what_happens():
    body = Body(imu_body_m=(0.0, 0.0))
    one = vehicle(body=body)
    one.thrusters.energise(0, 0)
    one.advance(80 * MS)
    one.thrusters.release(80 * MS, 0)
    one.advance(300 * MS)
    polls = felt(one)
    heading = np.cumsum(polls[:, 0]) * 1e-3
    table_x = np.cos(heading) * polls[:, 1] - np.sin(heading) * polls[:, 2]
    assert table_x.sum() * 1e-3 == pytest.approx(one.motion.vx_m_s, rel=2e-3)
    assert heading[-1] == pytest.approx(one.motion.heading_rad, rel=1e-2)


@settings(max_examples=20, deadline=None)
@given(cuts=st.lists(st.integers(1, 299), max_size=12), looks=st.lists(st.integers(1, 299), max_size=5))
def test_truth_does_not_depend_on_how_time_is_cut(cuts, looks):
    def fly(stops, peeks):
        one = vehicle(Motion(0.0, 0.0, 0.2, 0.01, 0.0, 0.5), tilt=(1e-4, 0.0))
        one.thrusters.energise(0, 0)
        for stop in sorted({*stops, 300}):
            for peek in sorted(peek for peek in peeks if peek * MS >= one.now_ns and peek <= stop):
                one.origin_at(peek * MS)
            one.advance(stop * MS)
        return one

    plain, cut = fly([], []), fly(cuts, looks)
    assert cut.motion.x_m == pytest.approx(plain.motion.x_m, abs=1e-8)
    assert cut.motion.heading_rad == pytest.approx(plain.motion.heading_rad, abs=1e-9)
    assert len(plain.take_felt()) == len(cut.take_felt()) == 300


def test_a_look_ahead_equals_the_motion_that_follows():
    one = vehicle(Motion(0.0, 0.0, 0.2, 0.01, 0.0, 0.5))
    one.thrusters.energise(0, 0)
    one.advance(20 * MS)
    seen = one.origin_at(27 * MS)
    assert one.now_ns == 20 * MS
    one.advance(27 * MS)
    assert one.motion.x_m == pytest.approx(seen.x_m, abs=1e-15)


def test_landing_while_moving_stops_by_friction():
    one = vehicle(Motion(0.0, 0.0, 0.0, 0.1, 0.0, 0.5))
    one.set_air(0, is_on=False, delay_s=0.0)
    one.advance(1 * S)
    assert (one.motion.vx_m_s, one.motion.rate_rad_s) == (0.0, 0.0)
    assert one.motion.x_m == pytest.approx(0.1**2 / (2 * 0.3 * GRAVITY_M_S2), rel=0.02)


def test_a_floor_shock_is_felt_landed_and_not_felt_gliding():
    landed, gliding = vehicle(floating=False, shocks_hz=2.0), vehicle(shocks_hz=2.0)
    landed.advance(5 * S)
    gliding.advance(5 * S)
    assert np.abs(felt(landed)[:, 1]).max() > 1e-3
    assert landed.motion == RESTING
    np.testing.assert_array_equal(felt(gliding), 0.0)
    assert gliding.motion != RESTING


def test_a_fast_crystal_polls_more_often():
    one = vehicle(clock_ppm=400.0)
    one.advance(10 * S)
    assert len(one.take_felt()) == 10_004


def fly_with_contacts(vehicles, until_ns, contacts):
    call_ns = 0
    while vehicles[0].now_ns < until_ns:
        for one in vehicles:
            one.advance(min(until_ns, call_ns))
        call_ns = contacts.resolve(vehicles)


def test_two_vehicles_that_touch_exchange_momentum_and_lose_what_restitution_says():
    left = vehicle(Motion(-0.5, 0.02, 0.0, 0.1, 0.0, 0.0))
    right = vehicle(Motion(0.5, 0.0, 0.0, -0.05, 0.0, 0.0), body=Body(mass_kg=8.0))
    before = 11.0 * 0.1 - 8.0 * 0.05
    contacts = Contacts((-2, 2, -2, 2), 0.5, 0.5)
    fly_with_contacts([left, right], 8 * S, contacts)
    assert contacts.count == 1
    after = 11.0 * left.motion.vx_m_s + 8.0 * right.motion.vx_m_s
    assert after == pytest.approx(before, abs=1e-12)
    parting = math.hypot(right.motion.vx_m_s - left.motion.vx_m_s, right.motion.vy_m_s - left.motion.vy_m_s)
    assert parting == pytest.approx(0.5 * 0.15, rel=0.02)


def test_the_rail_throws_a_vehicle_back_and_its_imu_feels_it():
    one = vehicle(Motion(0.0, 0.0, 0.0, 0.1, 0.0, 0.0))
    fly_with_contacts([one], 4 * S, Contacts((-0.5, 0.5, -0.5, 0.5), 0.5, 0.5))
    assert one.motion.vx_m_s == pytest.approx(-0.05, rel=1e-9)
    assert felt(one)[:, 1].min() == pytest.approx(-0.15 / 0.010, rel=1e-6)


def test_waviness_has_the_stated_size():
    gradients = []
    for seed in range(12):
        surface = Surface(LEVEL, 1e-4, 0.8, np.random.default_rng(seed))
        gradients += [surface.gradient(x, y) for x in np.linspace(-2, 2, 12) for y in np.linspace(-2, 2, 12)]
    assert np.std(gradients, axis=0) == pytest.approx([1e-4, 1e-4], rel=0.15)


def test_a_landed_vehicle_is_a_wall_to_one_that_glides_into_it():
    gliding = vehicle(Motion(-0.6, 0.0, 0.0, 0.1, 0.0, 0.0))
    landed = vehicle(Motion(0.0, 0.0, 0.0, 0.0, 0.0, 0.0), floating=False)
    fly_with_contacts([gliding, landed], 4 * S, Contacts((-2, 2, -2, 2), 0.5, 0.5))
    assert gliding.motion.vx_m_s == pytest.approx(-0.05, rel=1e-9)
    assert landed.motion == RESTING
