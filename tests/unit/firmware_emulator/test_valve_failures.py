"""What fails about valves, gas, supply and bus, seen on the wire and in the truth."""

import math

import numpy as np
import pytest
from pydantic import ValidationError

from drivers.laboratory import FailureRefused, InjectOrder
from drivers.valve_bus.protocol import (
    Arm,
    NodeFault,
    TankPressure,
    Undecodable,
    ValveCommand,
    ValveStatus,
    decode,
    encode,
)
from firmware_emulator.failures import FailureConfig
from firmware_emulator.laboratory import EmulatedLaboratory

MS = 1_000_000
S = 1_000_000_000
THRUST_N, SAG = 0.22, 0.97
PAIR = (127, 127, 0, 0, 0, 0, 0, 0)
CLOSED = (0,) * 8


def flight(failures, on_times_ms=CLOSED, seconds=1.0, **valves):
    """Commands every 20 ms (each a new pulse), armed; the laboratory and what the node sent, decoded."""
    vehicle = {
        "name": "alpha", "floating": True, "camera": {"source": "none"}, "drag_n_s_m": 0.0,
        "drag_nm_s": 0.0, "valves": {"spread": 0.0, "open_delay_sd_s": 0.0, **valves},
    }  # fmt: skip
    rows = [{"vehicle": "alpha", **row} for row in failures]
    laboratory = EmulatedLaboratory(
        {"vehicles": [vehicle], "failures": rows, "table": {"waviness_rad": 0.0}}, seed=1
    )
    received = []
    laboratory.deliver(0, "valve_bus", encode(Arm(0, is_armed=True)))
    for tick in range(round(50 * seconds)):
        command = ValveCommand(0, tick & 15, tick & 15, on_times_ms)
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(command))
        arrivals = laboratory.advance((tick + 1) * 20 * MS)
        received += [(a.stamp_ns, decode(a.data)) for a in arrivals if a.channel == "valve_bus"]
    laboratory.mock_ups[0].vehicle.advance(round(seconds * S))
    return laboratory, received


def bank(laboratory):
    return laboratory.mock_ups[0].vehicle.thrusters


def of(kind, received, start_ns=0, end_ns=10 * S):
    return [
        message for at_ns, message in received if isinstance(message, kind) and start_ns <= at_ns < end_ns
    ]


def test_a_weak_valve_gives_its_share_when_open_and_nothing_when_closed():
    weak = {"kind": "weak_valve", "parameters": {"valve": 1, "fraction": 0.4}}
    pushed, _ = flight([weak], PAIR)
    assert bank(pushed).wrench[0] == pytest.approx(THRUST_N * 1.4 * SAG**0.4, rel=1e-6)
    quiet, _ = flight([weak])
    assert bank(quiet).wrench == (0.0, 0.0, 0.0)


def test_a_weak_valve_that_leaks_gives_the_larger():
    rows = [
        {"kind": "weak_valve", "parameters": {"valve": 0, "fraction": 0.4}},
        {"kind": "leaking_valve", "parameters": {"valve": 0, "fraction": 0.1}},
    ]
    assert bank(flight(rows)[0]).wrench[0] == pytest.approx(0.1 * THRUST_N, rel=1e-6)
    assert bank(flight(rows, (127,) + (0,) * 7)[0]).wrench[0] == pytest.approx(0.4 * THRUST_N, rel=1e-6)


@pytest.mark.parametrize(("on_s", "period_s"), [(0.02, 0.25), (0.1, 0.25), (0.2, 0.25)])
def test_a_pulsing_valve_opens_by_itself_in_its_rhythm_and_the_node_knows_nothing_of_it(on_s, period_s):
    parameters = {"valve": 2, "on_s": on_s, "period_s": period_s}
    row = {"kind": "pulsing_valve", "start_s": 0.3011, "end_s": 1.3011, "parameters": parameters}
    laboratory, received = flight([row], seconds=1.5)
    assert bank(laboratory).used_impulse_n_s == pytest.approx(4 * on_s * THRUST_N, rel=1e-6)
    velocity = laboratory.mock_ups[0].vehicle.motion.vx_m_s
    assert velocity == pytest.approx(-4 * on_s * THRUST_N / 11.0, rel=0.01)
    assert {status.open_mask for status in of(ValveStatus, received)} == {0}


def test_a_pulsing_valve_is_open_first_and_closes_with_the_failure():
    row = {"kind": "pulsing_valve", "start_s": 0.1, "end_s": 0.15}
    laboratory, _ = flight([row], seconds=0.5)  # 0.1 s open, but for the failure's end
    assert bank(laboratory).used_impulse_n_s == pytest.approx(0.05 * THRUST_N, rel=1e-6)


@pytest.mark.parametrize("on_s", [0.5, 0.6])
def test_a_pulsing_valve_that_would_be_open_always_is_refused(on_s):
    given = {"on_s": on_s, "period_s": 0.5}
    with pytest.raises(
        ValidationError, match=f"'pulsing_valve' is open for on_s = {on_s} s of period_s = 0.5"
    ):
        FailureConfig(kind="pulsing_valve", vehicle="alpha", parameters=given)
    laboratory, _ = flight([])
    laboratory.deliver(S, "laboratory", InjectOrder("pulsing_valve", "alpha", given, for_s=1.0))
    (refused,) = [a.data for a in laboratory.advance(S) if a.channel == "laboratory"]
    assert isinstance(refused, FailureRefused)
    assert "always" in refused.reason


@pytest.mark.parametrize(("tank_bar", "share"), [(3.0, 0.5), (6.0, 1.0), (50.0, 1.0), (0.0, 0.0)])
def test_a_low_tank_is_measured_and_weakens_every_valve_below_the_regulators_pressure(tank_bar, share):
    row = {"kind": "low_tank", "start_s": 0.1, "end_s": 0.9, "parameters": {"tank_bar": tank_bar}}
    laboratory, received = flight([row], PAIR, seconds=0.8)
    assert bank(laboratory).wrench[0] == pytest.approx(share * 2 * THRUST_N * SAG, abs=1e-6)
    tank = of(TankPressure, received)[-1]
    assert tank.tank_pa == pytest.approx(tank_bar * 1e5, abs=60e3)
    assert tank.supply_pa == pytest.approx(min(6e5, tank_bar * 1e5) * SAG, abs=2000.0)
    refilled, _ = flight([row], PAIR, seconds=1.1)
    assert bank(refilled).wrench[0] == pytest.approx(2 * THRUST_N * SAG, rel=1e-6)


@pytest.mark.parametrize(("battery_v", "opens"), [(11.0, True), (9.0, True), (8.99, False), (0.0, False)])
def test_a_low_battery_is_reported_and_below_9_v_no_valve_opens(battery_v, opens):
    row = {"kind": "low_battery", "start_s": 0.2, "end_s": 0.8, "parameters": {"battery_v": battery_v}}
    laboratory, received = flight([row], PAIR, seconds=0.7)
    assert (bank(laboratory).wrench[0] > 0.1) == opens
    assert {status.open_mask for status in of(ValveStatus, received, S // 2)} == {0b11}  # driven all the same
    _, received = flight([row], PAIR)
    faults = {
        span: {status.node_faults for status in of(ValveStatus, received, *span)}
        for span in ((0, 200 * MS), (220 * MS, 800 * MS), (830 * MS, S))
    }
    assert list(faults.values()) == [{NodeFault(0)}, {NodeFault.SUPPLY_UNDERVOLTAGE}, {NodeFault(0)}]


@pytest.mark.parametrize("valve", [0, 1, 7])
def test_a_torn_coil_is_reported_and_its_valve_does_not_open(valve):
    row = {"kind": "open_coil", "start_s": 0.2, "end_s": 0.8, "parameters": {"valve": valve}}
    laboratory, received = flight([row], PAIR, seconds=0.7)
    healthy, _ = flight([], PAIR, seconds=0.7)
    assert (bank(laboratory).wrench[0] < 0.8 * bank(healthy).wrench[0]) == (valve in (0, 1))
    _, received = flight([row], PAIR)
    masks = {
        span: {status.valve_fault_mask for status in of(ValveStatus, received, *span)}
        for span in ((0, 200 * MS), (220 * MS, 800 * MS), (830 * MS, S))
    }
    assert list(masks.values()) == [{0}, {1 << valve}, {0}]


@pytest.mark.parametrize("rate_hz", [50.0, 1000.0, 2500.0])
def test_a_flooded_bus_carries_foreign_frames_at_the_rate_and_status_all_the_same(rate_hz):
    row = {"kind": "flooded_bus", "start_s": 0.2, "end_s": 0.8, "parameters": {"rate_hz": rate_hz}}
    _, received = flight([row])
    foreign = [(at, m) for at, m in received if isinstance(m, Undecodable)]
    assert len(foreign) == pytest.approx(0.59 * rate_hz, rel=0.06)
    assert {m.reason for _, m in foreign} == {"foreign_identifier"}
    assert 0.2 * S <= foreign[0][0] <= foreign[-1][0] <= 0.801 * S
    _, healthy = flight([])
    late_ns = [a - b for (a, _), (b, _) in zip(
        [row for row in received if isinstance(row[1], ValveStatus)],
        [row for row in healthy if isinstance(row[1], ValveStatus)], strict=True)]  # fmt: skip
    assert all(0 <= late <= 490_000 for late in late_ns)  # behind two frames at most


def test_a_flood_beyond_what_the_wire_carries_fills_it_and_no_queue_builds_up():
    row = {"kind": "flooded_bus", "start_s": 0.2, "end_s": 0.8, "parameters": {"rate_hz": 20000.0}}
    _, received = flight([row], PAIR)
    foreign = [at for at, message in received if isinstance(message, Undecodable)]
    wire_hz = 500_000 / (1.1 * (47 + 64))
    assert 0.85 * 0.59 * wire_hz < len(foreign) < 0.6 * wire_hz
    assert {status.open_mask for status in of(ValveStatus, received, 100 * MS)} == {0b11}


def test_a_node_that_babbles_with_its_own_identifier_repeats_its_last_status():
    row = {"kind": "flooded_bus", "start_s": 0.2, "parameters": {"rate_hz": 1000.0, "own_ids": 1}}
    _, received = flight([row])
    assert not of(Undecodable, received)
    counters = [status.counter for status in of(ValveStatus, received, 300 * MS)]
    assert len(counters) == pytest.approx(735, rel=0.05)
    steps = np.diff(counters) % 16
    assert set(steps) == {0, 1}


def pushed(heading_deg=0.0, floating=True, seconds=2.0, **parameters):
    vehicle = {
        "name": "alpha", "floating": floating, "start_heading_deg": heading_deg, "camera": {"source": "none"},
        "drag_n_s_m": 0.0, "drag_nm_s": 0.0,
    }  # fmt: skip
    row = {"kind": "pushed", "vehicle": "alpha", "start_s": 0.25, "end_s": 0.75, "parameters": parameters}
    laboratory = EmulatedLaboratory(
        {"vehicles": [vehicle], "failures": [row], "table": {"waviness_rad": 0.0}}, seed=1
    )
    for tick in range(round(50 * seconds)):  # a node without commands cuts its air
        laboratory.deliver(tick * 20 * MS, "valve_bus", encode(ValveCommand(0, tick & 15, 0, CLOSED)))
        laboratory.advance((tick + 1) * 20 * MS)
    laboratory.mock_ups[0].vehicle.advance(round(seconds * S))
    return laboratory.mock_ups[0].vehicle


@pytest.mark.parametrize("heading_deg", [0.0, 90.0])
def test_a_hand_pushes_along_the_tables_axes_for_its_span(heading_deg):
    motion = pushed(heading_deg, force_x_n=2.2, force_y_n=-1.1).motion
    assert (motion.vx_m_s, motion.vy_m_s) == pytest.approx((0.1, -0.05), rel=1e-9)
    assert motion.x_m == pytest.approx(0.5 * 0.5 * 0.1 + 1.25 * 0.1, rel=1e-6)
    assert motion.rate_rad_s == 0.0


def test_a_hand_turns():
    motion = pushed(force_x_n=0.0, torque_nm=-0.05).motion
    assert motion.rate_rad_s == pytest.approx(-0.05 * 0.5 / 0.25, rel=1e-9)
    assert motion.heading_rad == pytest.approx(-(0.5 * 0.5 * 0.1 + 1.25 * 0.1), rel=1e-6)
    assert (motion.vx_m_s, motion.vy_m_s) == (0.0, 0.0)


def test_a_landed_mock_up_does_not_yield_to_a_hand():
    assert pushed(floating=False, force_x_n=20.0, torque_nm=1.0).motion[:3] == (0.0, 0.0, 0.0)


def test_the_imu_feels_the_hand():
    vehicle = pushed(90.0, seconds=0.5, force_x_n=2.2, torque_nm=0.05)
    body, last = vehicle.body, vehicle.take_felt()[-1]
    rate, turn = 0.05 * 0.25 / 0.25, 0.05 / 0.25
    heading = math.pi / 2 + vehicle.motion.heading_rad - math.pi / 2
    push_x, push_y = 0.2 * math.cos(heading), -0.2 * math.sin(heading)
    arm_x, arm_y = body.imu_body_m
    expected = (
        rate,
        push_x - turn * arm_y - rate**2 * arm_x,
        push_y + turn * arm_x - rate**2 * arm_y,
    )
    assert last == pytest.approx(expected, abs=3e-4)


@pytest.mark.parametrize(
    ("kind", "parameters", "complaint"),
    [
        ("weak_valve", {"valve": 1.5}, "valve .* whole number"),
        ("weak_valve", {"fraction": math.nan}, "fraction .* got nan"),
        ("weak_valve", {"fraction": -0.1}, "fraction .* must lie in 0..1"),
        ("pulsing_valve", {"on_s": 0.0}, "on_s .* must lie in 0.02"),
        ("pulsing_valve", {"period_s": math.inf}, "period_s .* must lie in"),
        ("low_tank", {"tank_bar": -1.0}, "tank_bar .* must lie in 0..300"),
        ("low_battery", {"battery_v": 12.0}, "battery_v .* must lie in 0..11"),
        ("flooded_bus", {"rate_hz": 0.0}, "rate_hz .* must lie in 1..20000"),
        ("flooded_bus", {"own_ids": 0.5}, "own_ids .* whole number"),
        ("pushed", {"torque_nm": math.nan}, "torque_nm .* got nan"),
        ("shifted_imu", {"gyro_deg_s": math.nan}, "gyro_deg_s .* got nan"),
        ("other_imu", {"serial_number": 70000}, "serial_number .* must lie in 0..65535"),
        ("clock_jump", {"jump_ms": 1.5}, "jump_ms .* whole number"),
        ("slow_camera", {"keep_one_in": 0}, "keep_one_in .* must lie in 1..1000"),
        ("slow_camera", {"delay_s": -0.1}, "delay_s .* must lie in 0..4"),
        ("repeating_camera", {"pictures": 2.5}, "pictures .* whole number"),
        ("wrong_fixes", {"dheading_deg": 181.0}, "dheading_deg .* must lie in -180..180"),
    ],
)
def test_an_impossible_value_is_refused(kind, parameters, complaint):
    with pytest.raises(ValidationError, match=complaint):
        FailureConfig(kind=kind, vehicle="alpha", parameters=parameters)
