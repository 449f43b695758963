"""Scale and axes from rests: right within their sigmas, and unknown where nothing can tell."""

import math

import numpy as np
import pytest

from calibration.imu.tilt_axes import G_M_S2, Rest, combination, tilt_axes

READING = np.eye(2) + np.array([[0.02, 0.01], [-0.015, -0.03]])
M = np.eye(2) - np.linalg.inv(READING)
OFFSET = np.array([0.05, -0.02])
STD = 2e-5


def read(rng, force):
    return tuple(OFFSET + READING @ force + STD * rng.normal(size=2))


def on_blocks(rng, tilts, placed_rad=1e-4):
    rests = []
    for along in tilts:
        force = G_M_S2 * np.sin(np.array(along) + placed_rad * rng.normal(size=2))
        rests.append(Rest(read(rng, force), (STD, STD), tilt_rad=along, tilt_sigma_rad=placed_rad))
    return rests


def turned(rng, slope, headings=8, reported=(0.0, 0.0), noise_rad=3e-4):
    rests = []
    for heading in 2.0 * math.pi * np.arange(headings) / headings:
        c, s = math.cos(heading), math.sin(heading)
        force = -np.array([[c, s], [-s, c]]) @ slope
        seen = float(heading + noise_rad * rng.normal())
        rests.append(
            Rest(
                read(rng, force),
                (STD, STD),
                heading_rad=seen,
                heading_sigma_rad=noise_rad,
                slope_m_s2=reported,
            )
        )
    return rests


BLOCKS = ((0.0, 0.0), (0.02, 0.0), (-0.02, 0.0), (0.0, 0.02), (0.0, -0.02))


def test_gauge_blocks_give_all_four_numbers_within_their_sigmas():
    normal = []
    for seed in range(60):
        found = tilt_axes(on_blocks(np.random.default_rng(seed), BLOCKS))
        assert found.unknown == ()
        assert all(found.is_known(k) for k in range(6))
        normal.append((found.matrix - M).ravel() / np.sqrt(np.diag(found.covariance))[2:6])
        offset = (found.offset_m_s2 - OFFSET) / np.sqrt(np.diag(found.covariance))[:2]
        normal.append(np.tile(offset, 2))
    assert 0.7 < np.square(normal).mean() < 1.4


def test_headings_on_a_tilted_table_tell_difference_and_shear_but_not_the_common_part():
    slope = np.array([0.03, 0.01])
    found = tilt_axes(turned(np.random.default_rng(1), slope))
    assert len(found.unknown) == 2
    assert not any(found.is_known(k) for k in (2, 3, 4, 5))
    difference, sigma = combination(found, (1.0, 0.0, 0.0, -1.0))
    assert sigma < 6e-3
    assert abs(difference - (M[0, 0] - M[1, 1])) < 3.0 * sigma
    shear, sigma = combination(found, (0.0, 1.0, 1.0, 0.0))
    assert abs(shear - (M[0, 1] + M[1, 0])) < 3.0 * sigma


def test_a_known_slope_tells_the_rest_as_well():
    normal, slope = [], np.array([0.03, 0.01])
    for seed in range(60):
        rng = np.random.default_rng(seed)
        reported = tuple(slope + 1e-4 * rng.normal(size=2))
        found = tilt_axes(turned(rng, slope, reported=reported), 1e-4)
        assert found.unknown == ()
        normal.append((found.matrix - M).ravel() / np.sqrt(np.diag(found.covariance))[2:6])
    assert 0.7 < np.square(normal).mean() < 1.4


def test_tilting_along_one_axis_leaves_the_other_axis_unknown():
    found = tilt_axes(on_blocks(np.random.default_rng(4), BLOCKS[:3]))
    assert found.is_known(2)
    assert not found.is_known(5)
    assert len(found.unknown) == 2


def test_tilts_that_were_written_down_wrong_widen_the_sigmas():
    rests = on_blocks(np.random.default_rng(5), BLOCKS * 2)
    good = tilt_axes(rests)
    rests[1] = Rest(rests[1].reading_m_s2, (STD, STD), tilt_rad=(0.025, 0.0), tilt_sigma_rad=1e-4)
    bad = tilt_axes(rests)
    assert bad.chi_square_ratio > 20.0 > 3.0 > good.chi_square_ratio
    assert bad.covariance[2, 2] > 10.0 * good.covariance[2, 2]


@pytest.mark.parametrize(
    ("rests", "reported"),
    [
        (lambda rng: on_blocks(rng, BLOCKS[:2]), "at least 3 rests"),
        (lambda rng: on_blocks(rng, ((0.0, 0.0),) * 4), "too alike"),
        (lambda rng: turned(rng, np.array([1e-5, 0.0])), "too alike"),
        (lambda rng: [Rest(read(rng, np.zeros(2)), (STD, STD))] * 4, "heading"),
    ],
)
def test_rests_that_tell_nothing_are_refused(rests, reported):
    with pytest.raises(ValueError, match=reported):
        tilt_axes(rests(np.random.default_rng(6)))
