import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_emulator.plant.thrusters import (
    FAR_FUTURE_NS,
    BankFailures,
    GasSupply,
    Nozzle,
    ThrusterBank,
    ValveTiming,
)

MS = 1_000_000
STEADY = ValveTiming(open_sd_s=0.0)


def bank(count=2, timing=STEADY, supply=None, thrust_n=0.22):
    nozzles = [Nozzle((-0.15, 0.15 - 0.3 * index), (1.0, 0.0), thrust_n) for index in range(count)]
    return ThrusterBank(nozzles, (0.0, 0.0), timing, supply or GasSupply(), np.random.default_rng(0))


def run(thrusters, until_ns, now_ns=0):
    """Relax from event to event and return the impulse along body x."""
    impulse_n_s = 0.0
    while now_ns < until_ns:
        thrusters.pass_events(now_ns)
        end_ns = min(until_ns, thrusters.next_event_ns, now_ns + MS // 4)
        before = thrusters.wrench[0]
        duration_s = (end_ns - now_ns) / 1e9
        target = thrusters.target[0]
        rise_s = thrusters.timing.rise_s
        impulse_n_s += target * duration_s + (before - target) * rise_s * (1 - np.exp(-duration_s / rise_s))
        thrusters.relax(duration_s)
        now_ns = end_ns
    thrusters.pass_events(now_ns)
    return impulse_n_s


@settings(max_examples=25, deadline=None)
@given(on_ms=st.integers(10, 120))
def test_a_pulse_gives_its_impulse_less_opening_plus_closing_delay(on_ms):
    thrusters = bank(1)
    thrusters.energise(0, 0)
    impulse = run(thrusters, on_ms * MS)
    thrusters.release(on_ms * MS, 0)
    impulse += run(thrusters, (on_ms + 200) * MS, on_ms * MS)
    expected = 0.22 * (on_ms * 1e-3 - STEADY.open_s + STEADY.close_s)
    assert impulse == pytest.approx(expected, abs=1e-9)
    assert thrusters.used_impulse_n_s == pytest.approx(expected, abs=1e-9)


def test_a_pulse_shorter_than_the_opening_delay_gives_nothing():
    thrusters = bank(1)
    thrusters.energise(0, 0)
    run(thrusters, 5 * MS)
    thrusters.release(5 * MS, 0)
    run(thrusters, 100 * MS, 5 * MS)
    assert thrusters.used_impulse_n_s == 0.0
    assert thrusters.next_event_ns == FAR_FUTURE_NS


def test_a_valve_caught_while_closing_stays_open():
    thrusters = bank(1)
    thrusters.energise(0, 0)
    run(thrusters, 50 * MS)
    thrusters.release(50 * MS, 0)
    run(thrusters, 53 * MS, 50 * MS)
    thrusters.energise(53 * MS, 0)
    run(thrusters, 100 * MS, 53 * MS)
    assert thrusters.wrench[0] == pytest.approx(0.22, rel=1e-4)


def test_each_further_open_valve_sags_all():
    thrusters = bank(3)
    for valve in range(3):
        thrusters.energise(0, valve)
    run(thrusters, 100 * MS)
    assert thrusters.wrench[0] == pytest.approx(3 * 0.22 * 0.97**2, rel=1e-6)


def test_two_valves_that_differ_in_arm_only_cancel_their_torque():
    thrusters = bank(2)
    for valve in range(2):
        thrusters.energise(0, valve)
    run(thrusters, 100 * MS)
    assert thrusters.wrench[2] == pytest.approx(0.0, abs=1e-12)


def test_thrust_fades_when_the_tank_is_below_the_regulator():
    thrusters = bank(1, supply=GasSupply(tank_pa=1e6, supply_pa=0.6e6, tank_impulse_n_s=1.0))
    now_ns = 0
    for _ in range(40):
        thrusters.energise(now_ns, 0)
        run(thrusters, now_ns + 100 * MS, now_ns)
        thrusters.release(now_ns + 100 * MS, 0)
        run(thrusters, now_ns + 200 * MS, now_ns + 100 * MS)
        now_ns += 200 * MS
    assert thrusters.tank_pa < 0.6e6
    thrusters.energise(now_ns, 0)
    run(thrusters, now_ns + 50 * MS, now_ns)
    assert thrusters.wrench[0] == pytest.approx(0.22 * thrusters.tank_pa / 0.6e6, rel=0.02)


def test_stuck_and_leaking_valves_do_what_their_names_say():
    thrusters = bank(3)
    thrusters.set_failures(
        BankFailures(stuck_open=frozenset({0}), stuck_closed=frozenset({1}), leaks={2: 0.1})
    )
    thrusters.energise(0, 1)
    run(thrusters, 200 * MS)
    assert thrusters.wrench[0] == pytest.approx(0.22 * (1.0 + 0.1) * 0.97**0.1, rel=1e-6)


def test_opening_delays_scatter_as_stated():
    thrusters = bank(1, ValveTiming(open_sd_s=0.0005))
    delays = []
    for start_ns in itertools.islice(itertools.count(0, 200 * MS), 400):
        thrusters.energise(start_ns, 0)
        delays.append((thrusters.next_event_ns - start_ns) / 1e9)
        thrusters.release(start_ns, 0)
    assert np.mean(delays) == pytest.approx(0.006, abs=0.0001)
    assert np.std(delays) == pytest.approx(0.0005, rel=0.15)
