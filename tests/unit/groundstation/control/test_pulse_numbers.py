"""Pulses period by period, worked out by hand: 100 ms, 6 ms to open, 5 ms to close, at least 10 ms."""

import pytest
from pydantic import ValidationError

from groundstation.control.allocation import Allocator
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.state import NO_WRENCH, BodyWrench
from groundstation.control.valve_health import HEALTHY, STUCK_CLOSED, leaking
from groundstation.control.vehicle import VehicleModel, square_of_eight

ALLOCATOR = Allocator(VehicleModel(11.0, 0.25, square_of_eight()))


def make(**config):
    return PulseModulator(ALLOCATOR, PulseConfig(**config))


def forward(modulator, force_n):
    """On-times of both valves that push forward, and what they give."""
    found = modulator.update(BodyWrench((force_n, 0.0), 0.0))
    assert not any(found.on_time_ms[2:])
    return found.on_time_ms[:2], pytest.approx(found.delivered.force_body_n[0], abs=1e-12)


def test_what_it_is_by_default():
    assert PulseConfig().model_dump() == {
        "period_s": 0.1,
        "min_on_s": 0.010,
        "min_off_s": 0.010,
        "open_delay_s": 0.006,
        "close_delay_s": 0.005,
        "sag": 1.0,
    }


@pytest.mark.parametrize(
    ("key", "low", "high"),
    [
        ("period_s", 0.02, 0.12),
        ("min_on_s", 0.001, 0.05),
        ("min_off_s", 0.0, 0.05),
        ("open_delay_s", 0.0, 0.05),
        ("close_delay_s", 0.0, 0.05),
        ("sag", 0.5, 1.0),
    ],
)
def test_the_limits_of_what_may_be_set(key, low, high):
    for value in (low + (1e-4 if key == "sag" else 0.0), high):
        assert getattr(PulseConfig(**{key: value}), key) == value
    for value in (low - 1e-4, 1.001 * high, *([low] if key == "sag" else [])):
        with pytest.raises(ValidationError, match=key):
            PulseConfig(**{key: value})


def test_what_is_set_is_spelled_right_and_stays():
    with pytest.raises(ValidationError, match="perod_s"):
        PulseConfig(perod_s=0.1)
    with pytest.raises(ValidationError, match="frozen"):
        PulseConfig().period_s = 0.1
    PulseConfig(period_s=0.05, min_on_s=0.025, min_off_s=0.025)


def test_three_periods_with_what_is_carried():
    # 20 N ms of 0.44 N: 45.45 ms, on 46 for 45 ms: 19.8; 0.2 is carried: 45.9 ms, on 47; then 45.36 ms
    modulator = make()
    assert forward(modulator, 0.2) == ((46, 46), 0.198)
    assert forward(modulator, 0.2) == ((47, 47), 0.2024)
    assert forward(modulator, 0.2) == ((46, 46), 0.198)


@pytest.mark.parametrize(
    ("open_ms", "on_ms"), [(8.0, 0), (9.0, 10), (89.0, 90), (90.0, 127), (100.0, 127), (50.0, 51)]
)
def test_the_least_and_the_longest_pulse(open_ms, on_ms):
    assert forward(make(), 0.44 * open_ms / 100.0)[0] == (on_ms, on_ms)


@pytest.mark.parametrize(("period_s", "full_ms"), [(0.02, 40), (0.03, 50), (0.06, 90), (0.12, 127)])
def test_a_valve_that_stays_open_has_time_for_a_late_command(period_s, full_ms):
    assert forward(make(period_s=period_s), 0.44)[0] == (full_ms, full_ms)


def test_a_least_pulse_of_a_broken_number_is_rounded_up():
    assert forward(make(min_on_s=0.0101), 0.0396)[0] == (0, 0)
    assert forward(make(min_on_s=0.0101), 0.044)[0] == (11, 11)


def test_a_valve_that_stays_open_needs_no_opening_and_blows_on_when_it_closes():
    modulator = make()
    assert forward(modulator, 0.44) == ((127, 127), 0.0044 * 94)
    assert forward(modulator, 0.44) == ((127, 127), 0.44)
    found = modulator.update(NO_WRENCH)  # 2.64 N ms are carried: 6 ms, less than a least pulse
    assert found.on_time_ms == (0,) * 8
    assert found.delivered.force_body_n[0] == pytest.approx(0.0044 * 5)
    assert found.open_valve_s == pytest.approx(0.010)
    assert modulator.update(NO_WRENCH).open_valve_s == 0.0


def test_no_more_than_three_least_pulses_are_carried():
    modulator = make()
    forward(modulator, 4.0)
    # 6.6 N ms: 15 ms of both, which are open, so that the closing of 5 ms is a part of it
    assert forward(modulator, 0.0) == ((10, 10), 0.0044 * 15)


def test_what_is_not_wanted_opens_nothing_however_short_a_pulse_may_be():
    modulator = make(min_on_s=0.001)
    assert modulator.update(NO_WRENCH).on_time_ms == (0,) * 8
    assert forward(modulator, 0.0022)[0] == (2, 2)  # half a millisecond, and 6 - 5 more


def test_a_valve_that_stopped_to_obey_is_taken_to_be_closed():
    modulator = make()
    forward(modulator, 0.44)
    modulator.take_health((STUCK_CLOSED, *[HEALTHY] * 7))
    modulator.take_health(None)
    assert forward(modulator, 0.44) == ((127, 127), 0.0022 * 194)


def test_after_a_reset_all_are_taken_to_be_closed_and_nothing_is_carried():
    modulator = make()
    forward(modulator, 0.44)
    modulator.reset()
    assert forward(modulator, 0.44) == ((127, 127), 0.0044 * 94)
    modulator.reset()
    assert forward(modulator, 0.0) == ((0, 0), 0.0)


def test_a_leak_is_a_part_of_what_is_given_and_of_the_gas():
    modulator = make()
    modulator.take_health((leaking(0.2), *[HEALTHY] * 7))
    found = modulator.update(BodyWrench((0.044, 0.0), -0.0066))
    assert found.on_time_ms == (0,) * 8
    assert found.delivered.force_body_n == pytest.approx((0.044, 0.0))
    assert found.delivered.torque_nm == pytest.approx(-0.0066)
    assert found.open_valve_s == pytest.approx(0.02)
