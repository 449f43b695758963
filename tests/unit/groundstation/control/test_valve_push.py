"""Commanded pulses laid out in time: mean wrench over any span."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.control.valve_push import ValvePush
from groundstation.control.vehicle import VehicleModel, square_of_eight

MS = 1_000_000
MODEL = VehicleModel(11.0, 0.25, square_of_eight(0.15, 0.22))


def only(valve, on_ms):
    return tuple(on_ms if each == valve else 0 for each in range(8))


def test_a_pulse_pushes_from_its_delay_to_its_end():
    push = ValvePush(MODEL, 0.006, 0.005)
    push.command(100 * MS, 1, only(0, 50))
    whole = push.mean(100 * MS, 200 * MS)
    assert whole.force_body_n == pytest.approx((0.22 * 0.49, 0.0))  # 50 ms, opened 6 late, closed 5 late
    assert whole.torque_nm == pytest.approx(-0.15 * 0.22 * 0.49)
    assert push.mean(100 * MS, 106 * MS).force_body_n == (0.0, 0.0)
    assert push.mean(110 * MS, 120 * MS).force_body_n == pytest.approx((0.22, 0.0))


def test_refreshing_a_pulse_changes_nothing_and_a_new_id_ends_it():
    push = ValvePush(MODEL, 0.0, 0.0)
    push.command(0, 1, only(0, 100))
    push.command(20 * MS, 1, only(0, 80))
    assert push.mean(0, 100 * MS).force_body_n == pytest.approx((0.22, 0.0))
    push.command(40 * MS, 2, only(4, 30))
    assert push.mean(0, 100 * MS).force_body_n == pytest.approx((0.22 * 0.4, 0.22 * 0.3))


def test_a_valve_that_stays_open_from_pulse_to_pulse_has_no_gap():
    push = ValvePush(MODEL, 0.006, 0.005)
    for pulse in range(4):
        push.command(pulse * 100 * MS, pulse, only(0, 127))
    assert push.mean(50 * MS, 400 * MS).force_body_n == pytest.approx((0.22, 0.0))


def test_an_empty_span_is_refused():
    with pytest.raises(ValueError, match="span"):
        ValvePush(MODEL, 0.0, 0.0).mean(5, 5)


@given(
    st.lists(
        st.tuples(st.integers(1, 120), st.lists(st.integers(0, 127), min_size=8, max_size=8)),
        min_size=1,
        max_size=6,
    ),
    st.integers(0, 300),
    st.integers(1, 200),
)
def test_the_mean_is_that_of_a_millisecond_by_millisecond_count(pulses, start_ms, length_ms):
    push, now_ms = ValvePush(MODEL, 0.0, 0.0), 0
    is_open = np.zeros((1200, 8))
    for number, (wait_ms, on_ms) in enumerate(pulses):
        now_ms += wait_ms
        push.command(now_ms * MS, number, on_ms)
        is_open[now_ms:] = 0.0
        for valve, on in enumerate(on_ms):
            is_open[now_ms : now_ms + on, valve] = 1.0
    found = push.mean(start_ms * MS, (start_ms + length_ms) * MS)
    wanted = MODEL.effectiveness() @ is_open[start_ms : start_ms + length_ms].mean(axis=0)
    assert np.allclose((*found.force_body_n, found.torque_nm), wanted, atol=1e-12)
