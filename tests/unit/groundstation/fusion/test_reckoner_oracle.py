"""The reckoner and its oracle in plain Python are the same machine: every bit of every answer."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.carrier import OracleCarrier
from oracles.late_fix import OracleLateFix
from oracles.reckoner import OracleReckoner

from groundstation.core.library import default_core
from groundstation.fusion import checkpoint, error_state_filter
from groundstation.fusion import error_state as es
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import Counters, Fix, ImuPacket, PlanarState
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.reckoner import Reckoner
from groundstation.fusion.slope_grid import SlopeGrid

pytestmark = pytest.mark.core

PERIOD_NS = 10_000_000
NOISE = NoiseModel(
    packet_period_s=0.01,
    gyro_density_rad_s_rthz=6.7e-5,
    acc_density_m_s2_rthz=6.5e-5,
    star_sigma_xy_m=1e-3,
    star_sigma_heading_rad=1e-3,
    imu_offset_x_m=0.03,
    imu_offset_y_m=-0.02,
    gyro_tempco_rad_s_c=3e-4,
    acc_tempco_m_s2_c=3e-4,
    gyro_lag_s=4e-3,
    acc_lag_s=9e-3,
)
MAP = SlopeGrid(
    -1.0, -1.0, 0.5, *np.random.default_rng(0).normal(0.0, 3e-3, (3, 5, 5)), mean_m_s2=(1e-3, -2e-3)
)

readings = st.floats(-0.3, 0.3) | st.sampled_from([0.0, -0.0, 5.0, math.nan, math.inf])
packets = st.tuples(
    st.sampled_from([1, 1, 1, 1, 2, 9, 0, -1, -300]),  # ticks on from the packet before
    st.integers(-4_000_000, 4_000_000),  # jitter, ns
    readings,
    readings,
    readings,
    st.sampled_from([25.0, 25.1, 28.2, 31.0, math.nan, math.inf, 1e300, -9249.0]),
)


def bits(values):
    return np.array([*values], dtype=np.float64).tobytes()


def both(table_map=None):
    return [kind(NOISE, Counters(), table_map) for kind in (Reckoner, OracleReckoner)]


def loaded(reckoner, seed):
    rng = np.random.default_rng(seed)
    reckoner.has_pose, reckoner.is_lost = True, bool(seed % 2)
    reckoner.load(es.initial_state(NOISE) + rng.normal(0.0, 0.01, es.SIZE), rng.normal(0.0, 0.3, es.MOVING))
    reckoner.trust(reckoner.newest_s - 0.3, rng.uniform(0.0, 1e-6, 13).tolist())


def assert_same(first, second):
    assert bits(first.history.rows) == bits(second.history.rows)
    assert (first.origin_ns, first.newest_ns) == (second.origin_ns, second.newest_ns)
    assert bits([first.newest_s, first.rate_rad_s]) == bits([second.newest_s, second.rate_rad_s])
    assert first._counters.by_name == second._counters.by_name
    if first.has_pose:
        a, b = first.report(), second.report()
        assert bits(a) == bits(b)
        assert [type(value) for value in a] == [type(value) for value in b]


@settings(max_examples=60, deadline=None)
@given(before=st.lists(packets, max_size=30), after=st.lists(packets, max_size=60), rests=st.booleans())
@pytest.mark.parametrize("table_map", [None, MAP], ids=["no map", "map"])
def test_both_say_the_same_whatever_comes(table_map, before, after, rests):
    pair = both(table_map)
    t_ns, number = 1_000_000_000, 0
    for part, packets_of_it in enumerate((before, after)):
        if part and number:
            for reckoner in pair:
                loaded(reckoner, len(before))
        for ticks, jitter_ns, rate, ax, ay, temperature_c in packets_of_it:
            t_ns, number = t_ns + ticks * PERIOD_NS, number + 1
            packet = ImuPacket(t_ns + jitter_ns, max(ticks, 1) * 0.01, rate, ax, ay, temperature_c)
            if rests and number == 40:
                for reckoner in pair:
                    reckoner.rest(reckoner.newest_s, reckoner.newest_s + 0.1)
            taken = [reckoner.add(packet) for reckoner in pair]
            assert taken[0] is taken[1]
            assert_same(*pair)


@pytest.mark.parametrize("restart", [25, 60])
def test_both_follow_a_clock_that_jumped_back(restart):
    pair = both()
    for number in range(100):
        t_ns = (1000 + number if number < 30 else 1 + number) * PERIOD_NS
        packet = ImuPacket(t_ns, 0.01, 0.01, 0.02, 0.03, 25.0)
        if number == restart:
            for reckoner in pair:
                loaded(reckoner, 1)
        taken = [reckoner.add(packet) for reckoner in pair]
        assert taken[0] is taken[1]
    assert_same(*pair)
    assert pair[0]._counters.by_name["clock_jumped_back"] == 1


def test_records_are_laid_out_as_the_core_declares_them():
    ffi = default_core().ffi
    for record in (ImuPacket, PlanarState):
        assert tuple(name for name, _ in ffi.typeof(record.__name__).fields) == record._fields


def test_the_filter_on_oracles_estimates_the_same(monkeypatch):
    rng = np.random.default_rng(2)
    covariance = np.diag([1e-6, 1e-6, 1e-6])
    reports = []
    filters = [ErrorStateFilter(NOISE)]
    monkeypatch.setattr(error_state_filter, "Reckoner", OracleReckoner)
    monkeypatch.setattr(checkpoint, "Carrier", OracleCarrier)
    monkeypatch.setattr(checkpoint, "LateFix", OracleLateFix)
    filters.append(ErrorStateFilter(NOISE))
    for number in range(1, 1200):
        readings_now = rng.normal(0.0, 1e-3, 3)
        reported = [f.add_imu(ImuPacket(number * PERIOD_NS, 0.01, *readings_now, 25.0)) for f in filters]
        if number % 65 == 0:
            place = rng.normal(0.0, 1e-3, 3)
            for f in filters:
                f.add_fix(Fix((number - 60) * PERIOD_NS, number * PERIOD_NS, *place, covariance))
        reports.append(reported)
    assert filters[0].counters.by_name == filters[1].counters.by_name
    assert reports[-1][0] is not None
    for compiled, pure in reports:
        if pure is None:
            assert compiled is None
        else:
            np.testing.assert_allclose(compiled[1:13], pure[1:13], rtol=1e-9, atol=1e-12)
