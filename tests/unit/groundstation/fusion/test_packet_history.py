import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.fusion.packet_history import PacketHistory


def filled(n: int = 50, period: float = 0.01) -> PacketHistory:
    history = PacketHistory()
    for k in range(n):
        history.rows.extend(((k + 1) * period, period, float(k), 0.1 * k, 0.0, 0.0, 0.0))
    return history


@given(st.floats(0.0, 0.5), st.floats(0.0, 0.5), st.floats(0.0, 0.5))
def test_two_stretches_hold_what_the_whole_holds(a, b, c):
    a, b, c = sorted((a, b, c))
    history = filled()
    whole, first, second = history.between(a, c), history.between(a, b), history.between(b, c)
    turned = [float((s.rate_rad_s * s.span_s).sum()) for s in (whole, first, second)]
    assert turned[1] + turned[2] == pytest.approx(turned[0], abs=2e-7)  # slivers below 1 ns are left out
    assert whole.span_s.sum() == pytest.approx(c - a, abs=3e-9)


def test_time_before_the_first_packet_is_not_made_up():
    history = filled()
    del history.rows[: 7 * 10]
    segment = history.between(0.0, 0.2)
    assert segment.start_s == pytest.approx(0.1)
    assert segment.span_s.sum() == pytest.approx(0.1)


def test_time_after_the_newest_packet_is_not_made_up():
    segment = filled().between(0.4, 2.0)
    assert segment.stop_s == pytest.approx(0.5)


def test_forgetting_keeps_what_a_hole_needs_for_company():
    history = filled()
    history.forget_before(0.4, keep=10)
    assert history.first_s == pytest.approx(0.3)
    assert len(history.between(0.4, 0.5).span_s) == 10


def test_an_empty_history_gives_an_empty_stretch():
    assert len(PacketHistory().between(0.0, 1.0).span_s) == 0


def test_the_gyro_is_read_in_the_packet_that_covers_the_moment():
    assert filled().rate_at(0.255) == 25.0
    assert filled().rate_at(9.0) == 49.0
    assert np.isfinite(filled().rate_at(-1.0))
