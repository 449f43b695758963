"""How long the gas lasts: against drawn tanks, and against the emulator's tank emptied by the modulator."""

import math

import numpy as np
import pytest
from scipy.stats import chi2

from firmware_emulator.plant.thrusters import GasSupply, Nozzle, ThrusterBank, ValveTiming
from groundstation.control.allocation import Allocator
from groundstation.control.gas import GasConfig, GasHistory, gas_left
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.state import BodyWrench
from groundstation.control.vehicle import VehicleModel, square_of_eight

CONFIG = GasConfig(reserve_pa=30e5, pressure_sigma_pa=0.2e5)
BAR = 1e5


def flown(rng, *, float_pa_s, valve_pa_s, start_pa=200e5, use=0.5, hover_s=0.0, duration_s=4000.0):
    """A mock-up that hovers without steering at first, then steers now more, now less; a reading a second."""
    t_s = np.arange(0.0, duration_s)
    steering = np.where(t_s < hover_s, 0.0, rng.gamma(4.0, use / 4.0, len(t_s)))
    valves_s = np.cumsum(steering)
    true_pa = start_pa - float_pa_s * t_s - valve_pa_s * valves_s
    return GasHistory(t_s, true_pa + rng.normal(0.0, 0.2e5, len(t_s)), t_s, valves_s), true_pa


def until(history, count):
    return GasHistory(
        history.t_s[:count], history.pressure_pa[:count], history.afloat_s[:count], history.valves_s[:count]
    )


def test_spans_come_out_within_their_sigmas():
    """A hundred tanks, looked at after five minutes."""
    squares = {"afloat": [], "steering": []}
    for seed in range(100):
        rng = np.random.default_rng(seed)
        float_pa_s, valve_pa_s = rng.uniform(2e3, 8e3), rng.uniform(5e3, 2e4)
        history, true_pa = flown(rng, float_pa_s=float_pa_s, valve_pa_s=valve_pa_s, hover_s=120.0)
        left = gas_left(until(history, 300), CONFIG)
        truly = {
            "afloat": (true_pa[299] - CONFIG.reserve_pa) / float_pa_s,
            "steering": float(np.argmax(true_pa < CONFIG.reserve_pa)) - 299.0,
        }
        assert left.reason == ""
        assert left.pressure_pa == pytest.approx(true_pa[299], abs=0.15e5)
        for name, span_s in truly.items():
            found = getattr(left, name)
            squares[name].append(((found.span_s - span_s) / found.sigma_s) ** 2)
            assert found.sigma_s < 0.15 * span_s
    low, high = chi2.ppf([0.0005, 0.9995], 100)
    for name, found in squares.items():
        assert low < sum(found) < high, name


def test_who_steers_evenly_all_the_time_is_not_told_how_long_it_would_only_float():
    t_s = np.arange(600.0)
    history = GasHistory(t_s, 200e5 - 1.2e4 * t_s, t_s, 0.4 * t_s)
    left = gas_left(history, CONFIG)
    assert left.afloat is None
    assert left.reason.startswith("what the float air takes cannot be told from what the valves take")
    assert left.steering is not None
    assert left.steering.span_s == pytest.approx((200e5 - 1.2e4 * 599 - 30e5) / 1.2e4, rel=1e-3)


def test_a_tank_that_was_filled_begins_a_new_history():
    t_s = np.arange(200.0)
    pressure_pa = np.where(t_s < 100.0, 60e5 - 1e4 * t_s, 200e5 - 2e4 * (t_s - 100.0))
    left = gas_left(GasHistory(t_s, pressure_pa, t_s, np.zeros(200)), CONFIG)
    assert left.afloat is not None
    assert left.afloat.span_s == pytest.approx((pressure_pa[-1] - 30e5) / 2e4, rel=1e-3)


def test_a_tank_at_its_reserve_lasts_no_longer():
    t_s = np.arange(100.0)
    left = gas_left(GasHistory(t_s, 31e5 - 1e4 * t_s, t_s, np.zeros(100)), CONFIG)
    assert left.afloat is not None
    assert left.afloat.span_s == 0.0


@pytest.mark.parametrize(
    ("readings", "words"),
    [(0, "only 0 readings"), (9, "only 9 readings"), (60, "no consumption is seen yet")],
)
def test_what_has_not_been_seen_is_not_said(readings, words):
    t_s = np.arange(float(readings))
    still = np.zeros(readings)
    left = gas_left(GasHistory(t_s, np.full(readings, 150e5), still, still), CONFIG)
    assert (left.afloat, left.steering) == (None, None)
    assert left.reason.startswith(words)
    assert math.isnan(left.pressure_pa) if not readings else left.pressure_pa == pytest.approx(150e5)


def test_readings_that_are_none_are_left_out():
    t_s = np.arange(300.0)
    pressure_pa = 200e5 - 2e4 * t_s
    whole = gas_left(GasHistory(t_s, pressure_pa, t_s, np.zeros(300)), CONFIG)
    pressure_pa[::7] = np.nan
    holed = gas_left(GasHistory(t_s, pressure_pa, t_s, np.zeros(300)), CONFIG)
    assert holed.afloat is not None
    assert whole.afloat is not None
    assert holed.afloat.span_s == pytest.approx(whole.afloat.span_s, rel=1e-6)


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"t_s": [0.0, 1.0]}, "as many of each"), ({"valves_s": [0.0, 2.0, 1.0]}, "valves does")],
)
def test_a_history_that_cannot_be_is_refused(changes, words):
    columns = {name: [0.0, 1.0, 2.0] for name in ("t_s", "pressure_pa", "afloat_s", "valves_s")} | changes
    with pytest.raises(ValueError, match=words):
        GasHistory(**{name: np.array(column) for name, column in columns.items()})


def emptied(seed):
    """The emulator's valves and tank, driven by pulses, read once a second; (history, true pressures)."""
    rng = np.random.default_rng(seed)
    valves = square_of_eight()
    timing = ValveTiming(sag=0.97)
    nozzles = [
        Nozzle(valve.position_body_m, valve.direction_body, 0.22 * rng.uniform(0.95, 1.05))
        for valve in valves
    ]
    bank = ThrusterBank(nozzles, (0.0, 0.0), timing, GasSupply(tank_impulse_n_s=40.0), rng)
    modulator = PulseModulator(Allocator(VehicleModel(11.0, 0.25, valves)), PulseConfig(sag=0.97))
    rows, valves_s, now_ns, period = [], 0.0, 0, 0
    while bank.tank_pa > 25e5:
        force = rng.normal(0.0, 0.08, 2)
        pulses = modulator.update(BodyWrench((force[0], force[1]), rng.normal(0.0, 0.008)))
        valves_s += pulses.open_valve_s
        ends = {}
        for valve, on_ms in enumerate(pulses.on_time_ms):
            if on_ms:
                bank.energise(now_ns, valve)
                ends[valve] = now_ns + on_ms * 1_000_000
            else:
                bank.release(now_ns, valve)
        stop_ns = now_ns + 100_000_000
        while now_ns < stop_ns:
            next_ns = min(stop_ns, bank.next_event_ns, *ends.values())
            bank.relax((next_ns - now_ns) * 1e-9)
            now_ns = next_ns
            for valve in [valve for valve, end_ns in ends.items() if end_ns <= now_ns]:
                bank.release(now_ns, valve)
                del ends[valve]
            bank.pass_events(now_ns)
        period += 1
        if period % 10 == 0:
            rows.append((now_ns * 1e-9, bank.tank_pa, valves_s))
    t_s, true_pa, spent_s = np.array(rows).T
    return GasHistory(t_s, true_pa + rng.normal(0.0, 0.2e5, len(t_s)), t_s, spent_s), true_pa


def test_the_emulators_tank_lasts_as_long_as_was_said():
    """Its float air has a supply of its own, which is found out and said."""
    squares = []
    for seed in range(8):
        history, true_pa = emptied(seed)
        count = len(history.t_s) // 3
        left = gas_left(until(history, count), CONFIG)
        assert left.steering is not None
        truly_s = history.t_s[int(np.argmax(true_pa < CONFIG.reserve_pa))] - history.t_s[count - 1]
        squares.append(((left.steering.span_s - truly_s) / left.steering.sigma_s) ** 2)
        assert left.steering.span_s == pytest.approx(truly_s, rel=0.15)
    low, high = chi2.ppf([0.0005, 0.9995], len(squares))
    assert low < sum(squares) < high
