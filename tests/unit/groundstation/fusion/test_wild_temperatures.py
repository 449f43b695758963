"""What a thermometer says that no block can be is set aside: the filter goes on without it."""

import math

import numpy as np
import pytest

from groundstation.fusion.estimator import Counters, ImuPacket
from groundstation.fusion.noise import NoiseModel
from groundstation.fusion.reckoner import Reckoner

PERIOD_S = 0.01
NOISE = NoiseModel(
    packet_period_s=PERIOD_S,
    gyro_density_rad_s_rthz=6.7e-5,
    acc_density_m_s2_rthz=6.5e-5,
    star_sigma_xy_m=1e-3,
    star_sigma_heading_rad=1e-3,
    imu_offset_x_m=0.0,
    imu_offset_y_m=0.0,
    gyro_tempco_rad_s_c=3e-4,
)
WARMTH = 5
"""Column of the history: temperature above that of the first packet."""
WILD = [9249.0, 1e300, math.inf, -math.inf, -1e300, 295.0, 125.0, -40.0, 40.0]


def warmths(temperatures_c):
    counters = Counters()
    reckoner = Reckoner(NOISE, counters)
    for k, temperature_c in enumerate(temperatures_c, 1):
        assert reckoner.add(ImuPacket(k * 10_000_000, PERIOD_S, 0.001, 0.0, 0.0, temperature_c))
    rows = np.array(reckoner.history.rows).reshape(len(temperatures_c), -1)
    return rows[:, WARMTH], counters.by_name.get("packet_temperature_set_aside", 0)


@pytest.mark.parametrize("rows", [1, 2, 50, 200])
@pytest.mark.parametrize("wild_c", WILD)
def test_the_filter_goes_on_with_the_temperature_before(wild_c, rows):
    given = np.full(600, 22.0)
    given[300 : 300 + rows] = wild_c
    found, aside = warmths(given)
    np.testing.assert_array_equal(found, np.zeros(600))
    assert aside == rows


@pytest.mark.parametrize("wild_c", [9249.0, 1e300, math.inf, 295.0])
def test_a_first_temperature_that_no_block_has_is_no_reference(wild_c):
    found, aside = warmths([wild_c, wild_c, 22.0, 22.5])
    np.testing.assert_array_equal(found, [0.0, 0.0, 0.0, 0.5])
    assert aside == 2


def test_a_block_that_warms_is_followed_and_one_that_was_not_heard_of_may_have_cooled():
    ramp = 22.0 + 0.5 * PERIOD_S * np.arange(3000)
    found, aside = warmths(ramp)
    np.testing.assert_allclose(found, ramp - 22.0, atol=1e-9)
    assert aside == 0
    silent = np.concatenate([[22.0], np.full(1000, math.nan), [12.0]])
    found, aside = warmths(silent)
    assert (found[-1], aside) == (-10.0, 0)
