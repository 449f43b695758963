"""The carrier does what its oracle in NumPy does, to rounding."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.carrier import OracleCarrier

from groundstation.fusion import error_state as es
from groundstation.fusion.carrier import Carrier
from groundstation.fusion.packet_history import PacketHistory
from groundstation.fusion.slope_grid import SlopeGrid

pytestmark = pytest.mark.core

RNG = np.random.default_rng(5)
MAP = SlopeGrid(-1.0, -1.0, 0.25, *RNG.normal(0.0, 3e-3, (3, 9, 9)), mean_m_s2=(1e-3, -2e-3))
ROUNDING = 1e-12  # of sums of a hundred terms of order one


def a_history(rng, n, period, holes):
    history = PacketHistory()
    span = np.full(n, period)
    span[rng.integers(0, n, 3)] *= 3.0
    end = np.cumsum(span)
    force = rng.normal(0.0, 0.02, (2, n)) + np.where(rng.random((2, n)) < 0.1, 0.1, 0.0)
    rows = np.column_stack([end, span, rng.normal(0.3, 0.2, n), *force, rng.normal(0.0, 1.0, n), np.zeros(n)])
    rows[rng.integers(0, n, holes), 6] = 1.0
    history.rows.extend(rows.ravel().tolist())
    return history, float(end[-1])


def a_state(rng):
    x = rng.normal(0.0, 0.01, es.SIZE + 4)  # some nodes of a surface behind
    x[es.THETA], x[es.VX], x[es.PX] = 0.7, 0.05, rng.uniform(-1.2, 1.2)
    return x


def assert_close(found, expected):
    scale = max(1e-9, float(np.abs(expected).max()))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=ROUNDING * scale)


@pytest.mark.parametrize("table_map", [None, MAP], ids=["no map", "map"])
@pytest.mark.parametrize("holes", [0, 4])
@pytest.mark.parametrize("period", [0.01, 0.001])
@pytest.mark.parametrize("seed", range(4))
def test_both_carry_a_stretch_alike(noise, table_map, holes, period, seed):
    rng = np.random.default_rng(seed)
    history, end_s = a_history(rng, 120, period, holes)
    x = a_state(rng)
    noise = replace(noise, packet_period_s=period, gyro_lag_s=4e-3, acc_lag_s=9e-3)
    cores = [Carrier(noise, table_map), OracleCarrier(noise, table_map)]
    cuts = np.sort(rng.uniform(-0.1 * end_s, 1.1 * end_s, 4))
    for start_s, stop_s in [(0.0, end_s), *zip(cuts[:-1].tolist(), cuts[1:].tolist(), strict=True)]:
        compiled, pure = (carrier.carry(x, history, start_s, stop_s) for carrier in cores)
        if pure is None:
            assert compiled is None
            assert cores[0].fly(x, history, start_s, stop_s) is None
            continue
        assert compiled.duration_s == pytest.approx(pure.duration_s, rel=ROUNDING)
        assert compiled.turned_rad == pytest.approx(pure.turned_rad, rel=1e-9, abs=ROUNDING)
        assert_close(compiled.moved, pure.moved)
        assert_close(cores[0].fly(x, history, start_s, stop_s), pure.moved)
        for row in range(es.MOVING):
            assert_close(compiled.rows[row], pure.rows[row])
            assert_close(compiled.noise[row], pure.noise[row])


def test_a_stretch_within_one_packet_is_cut_at_both_ends(noise):
    history = PacketHistory()
    history.rows.extend((1.0, 1.0, 0.2, 0.1, 0.0, 0.0, 0.0))
    found = Carrier(noise, None).carry(np.zeros(es.SIZE), history, 0.25, 0.75)
    assert found.duration_s == pytest.approx(0.5)
    assert found.moved[es.THETA] == pytest.approx(0.1)


@pytest.mark.parametrize("kind", [Carrier, OracleCarrier])
def test_nothing_stored_carries_nothing(noise, kind):
    carrier = kind(noise, None)
    assert carrier.carry(np.zeros(es.SIZE), PacketHistory(), 0.0, 1.0) is None
    assert carrier.fly(np.zeros(es.SIZE), PacketHistory(), 0.0, 1.0) is None
