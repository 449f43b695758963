"""Pulses: what real valves can follow, and nothing lost on the way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from groundstation.control.allocation import Allocator
from groundstation.control.modulation import MAX_ON_MS, PulseConfig, PulseModulator
from groundstation.control.state import NO_WRENCH, BodyWrench
from groundstation.control.vehicle import VehicleModel, square_of_eight

ALLOCATOR = Allocator(VehicleModel(11.0, 0.25, square_of_eight()))
demands = st.builds(BodyWrench, st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)), st.floats(-0.15, 0.15))


def vector(wrench):
    return np.array((*wrench.force_body_n, wrench.torque_nm))


def true_open_ms(on_ms, period_ms, opening_ms, closing_ms):
    """Open time of one valve over a sequence of commands, replayed millisecond by millisecond."""
    opens_at = closes_at = -1.0
    total = 0.0
    for count, on in enumerate(on_ms):
        now = count * period_ms
        is_open = opens_at <= now < closes_at
        if on:
            opens_at = opens_at if is_open else now + opening_ms
            closes_at = now + on + closing_ms
        else:
            closes_at = min(closes_at, now + closing_ms)
        total += sum(opens_at <= now + ms < closes_at for ms in range(int(period_ms)))
    tail = max(0.0, closes_at - len(on_ms) * period_ms)
    return total + tail


@given(st.lists(demands, min_size=1, max_size=30), st.sampled_from([0.06, 0.08, 0.1]))
def test_no_pulse_is_shorter_than_a_valve_can_give_or_longer_than_the_wire_can_say(sequence, period_s):
    modulator = PulseModulator(ALLOCATOR, PulseConfig(period_s=period_s))
    for demand in sequence:
        pulses = modulator.update(demand)
        assert all(on == 0 or 10 <= on <= MAX_ON_MS for on in pulses.on_time_ms)
        assert all(isinstance(on, int) for on in pulses.on_time_ms)


@given(
    st.tuples(st.floats(-0.2, 0.2), st.floats(-0.2, 0.2)),
    st.floats(-0.02, 0.02),
    st.sampled_from([0.06, 0.1]),
)
@settings(max_examples=30)
def test_on_average_the_demand_is_delivered(force, torque, period_s):
    modulator = PulseModulator(ALLOCATOR, PulseConfig(period_s=period_s))
    demand, periods = BodyWrench(force, torque), 200
    mean = sum(vector(modulator.update(demand).delivered) for _ in range(periods)) / periods
    # what may still be carried: three least pulses of 10 ms, spread over all periods
    carried = 3 * 0.010 * np.array((0.22, 0.22, 0.033)) / (periods * period_s)
    kept = vector(ALLOCATOR.envelope.saturate(demand))
    assert (np.abs(mean - kept) <= carried + 1e-9).all()


def test_demands_below_the_least_pulse_wait_until_they_are_worth_one():
    modulator = PulseModulator(ALLOCATOR, PulseConfig())
    fired = [sum(modulator.update(BodyWrench((0.011, 0.0), 0.0)).on_time_ms) for _ in range(8)]
    assert fired[0] == 0
    assert any(fired)
    assert all(on == 0 or on >= 10 for on in fired)


def test_a_demand_that_changes_sign_burns_nothing():
    modulator = PulseModulator(ALLOCATOR, PulseConfig())
    for _ in range(20):
        assert modulator.update(BodyWrench((0.015, 0.0), 0.0)).open_valve_s == 0.0
        assert modulator.update(BodyWrench((-0.015, 0.0), 0.0)).open_valve_s == 0.0


def test_full_demand_leaves_no_gap_between_periods():
    modulator = PulseModulator(ALLOCATOR, PulseConfig(period_s=0.1))
    for _ in range(3):
        pulses = modulator.update(BodyWrench((0.44, 0.0), 0.0))
        assert pulses.on_time_ms == (127, 127, 0, 0, 0, 0, 0, 0)
    assert pulses.delivered.force_body_n[0] == pytest.approx(0.44)


@given(st.lists(demands, min_size=1, max_size=20))
def test_the_delivered_wrench_is_what_slow_valves_really_give(sequence):
    config = PulseConfig(period_s=0.1)
    modulator = PulseModulator(ALLOCATOR, config)
    pulses = [modulator.update(demand) for demand in [*sequence, NO_WRENCH, NO_WRENCH, NO_WRENCH]]
    columns = ALLOCATOR.effectiveness
    on = np.array([one.on_time_ms for one in pulses])
    opened = np.array([true_open_ms(on[:, valve].tolist(), 100.0, 6.0, 5.0) for valve in range(8)])
    claimed = sum(vector(one.delivered) for one in pulses) * config.period_s
    assert columns @ opened / 1000.0 == pytest.approx(claimed, abs=1e-9)
    assert opened.sum() / 1000.0 == pytest.approx(sum(one.open_valve_s for one in pulses))


def sagged_impulse(on, columns, sag, config):
    """Newton-seconds by 0.1 ms steps: every valve by its delays, all the weaker the more are open."""
    period_ms, step_ms = config.period_s * 1000.0, 0.1
    closes_at = np.full(8, -1.0)
    total = np.zeros(3)
    for row in on:
        opens_at = np.where(closes_at > 0.0, 0.0, config.open_delay_s * 1000.0)
        close_ms = config.close_delay_s * 1000.0
        closes_at = np.where(row > 0, row + close_ms, np.minimum(closes_at, close_ms))
        middle = np.arange(0.5 * step_ms, period_ms, step_ms)[:, None]
        is_open = (middle >= np.where(row > 0, opens_at, 0.0)) & (middle < closes_at)
        factor = sag ** np.maximum(0.0, is_open.sum(axis=1) - 1.0)
        total += columns @ (is_open * factor[:, None]).sum(axis=0) * step_ms / 1000.0
        closes_at = closes_at - period_ms
    return total


@given(st.lists(demands, min_size=1, max_size=12), st.sampled_from([0.97, 0.9]))
@settings(max_examples=25)
def test_a_sagging_supply_delivers_what_is_said(sequence, sag):
    config = PulseConfig(sag=sag)
    modulator = PulseModulator(ALLOCATOR, config)
    pulses = [modulator.update(demand) for demand in [*sequence, NO_WRENCH, NO_WRENCH, NO_WRENCH]]
    on = np.array([one.on_time_ms for one in pulses], dtype=float)
    claimed = sum(vector(one.delivered) for one in pulses) * config.period_s
    assert sagged_impulse(on, ALLOCATOR.effectiveness, sag, config) == pytest.approx(claimed, abs=1e-9)


def test_what_the_sag_takes_is_given_later():
    demand, periods = BodyWrench((0.2, 0.1), 0.01), 100
    told, untold = (PulseModulator(ALLOCATOR, PulseConfig(sag=sag)) for sag in (0.94, 1.0))
    config = told.config
    wanted = vector(demand) * periods * config.period_s
    given = [
        sagged_impulse(
            [np.array(modulator.update(demand).on_time_ms, dtype=float) for _ in range(periods)],
            ALLOCATOR.effectiveness,
            0.94,
            config,
        )
        for modulator in (told, untold)
    ]
    carried = 3 * 0.010 * np.array((0.22, 0.22, 0.033))
    assert (np.abs(given[0] - wanted) <= carried).all()
    assert given[1][0] < 0.96 * wanted[0]


def test_a_saturated_demand_is_not_remembered():
    modulator = PulseModulator(ALLOCATOR, PulseConfig())
    for _ in range(50):
        modulator.update(BodyWrench((4.0, 0.0), 0.0))
    after = [modulator.update(NO_WRENCH).open_valve_s for _ in range(4)]
    # at most the closing delay of two valves and one carried rest
    assert sum(after) <= 2 * 0.005 + 3 * 0.010 * 2
    assert after[-1] == 0.0


def test_a_reset_forgets_the_carried_rest():
    modulator = PulseModulator(ALLOCATOR, PulseConfig())
    modulator.update(BodyWrench((0.02, 0.0), 0.0))
    modulator.reset()
    first = PulseModulator(ALLOCATOR, PulseConfig()).update(BodyWrench((0.02, 0.0), 0.0))
    assert modulator.update(BodyWrench((0.02, 0.0), 0.0)) == first


def test_a_least_pulse_that_does_not_fit_the_period_is_refused():
    with pytest.raises(ValidationError, match="must fit into period_s"):
        PulseConfig(period_s=0.05, min_on_s=0.03, min_off_s=0.03)
