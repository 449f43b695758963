"""Alignments of drawn poses come back within their sigmas; what cannot be told is refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calibration.motion_capture.alignment import NAMES, Pairs, align, residuals
from calibration.outcome import CalibrationRefusedError

SIGMA = (0.0003, 0.0005)


def drawn(true, rng, count=200, turn_rad=3.0, span_m=1.0):
    """Poses of a mock-up, and what a system so aligned would see, by the forward equations."""
    o_x, o_y, psi, q_x, q_y, k, d_s = true
    pose = np.column_stack(
        (
            rng.uniform(-span_m / 2, span_m / 2, count),
            rng.uniform(-span_m / 2, span_m / 2, count),
            rng.uniform(-turn_rad / 2, turn_rad / 2, count),
        )
    )
    velocity = rng.normal(0.0, 0.1, (count, 3))
    late = pose - velocity * d_s  # seen earlier than it is stamped
    pivot = late[:, 0] + 1j * late[:, 1] + np.exp(1j * late[:, 2]) * complex(q_x, q_y)
    seen = (pivot - complex(o_x, o_y)) * np.exp(-1j * psi)
    noise = rng.normal(0.0, 1.0, (count, 3)) * [SIGMA[0], SIGMA[0], SIGMA[1]]
    table = np.column_stack((seen.real, seen.imag, late[:, 2] + k - psi)) + noise
    return Pairs(table, pose, velocity, np.tile(SIGMA, (count, 1)))


@settings(max_examples=15, deadline=None)
@given(
    st.tuples(
        *(st.floats(-2.0, 2.0),) * 2, st.floats(-3.1, 3.1), *(st.floats(-0.2, 0.2),) * 2,
        st.floats(-3.1, 3.1), st.floats(-0.02, 0.02),
    ),
    st.integers(0, 2**32 - 1),
)  # fmt: skip
def test_any_alignment_comes_back(true, seed):
    pairs = drawn(true, np.random.default_rng(seed))
    found = align(pairs)
    missed = found.value - np.array(true)
    missed[[2, 5]] = np.angle(np.exp(1j * missed[[2, 5]]))
    assert (np.abs(missed) < 5.0 * found.sigma).all(), dict(zip(NAMES, missed / found.sigma, strict=True))
    assert 0.7 < found.chi_square_ratio < 1.4
    left = residuals(found.value, pairs)
    assert np.sqrt((left[:, :2] ** 2).mean()) < 2.0 * SIGMA[0]


def test_swapped_markers_hardly_matter():
    rng = np.random.default_rng(3)
    true = (0.4, -1.0, 0.6, 0.02, -0.03, 0.25, 0.003)
    pairs = drawn(true, rng)
    pairs.seen[::20, :2] += 0.3
    found = align(pairs)
    assert abs(found.value[0] - 0.4) < 2e-3
    assert abs(found.value[2] - 0.6) < 2e-3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"count": 10}, "10 poses were seen by both, 30 are needed"),
        ({"turn_rad": 0.2}, "does not tell the pivot from the origin"),
        ({"span_m": 0.05}, "does not tell the system's yaw"),
    ],
)
def test_what_cannot_be_told_is_refused(arguments, words):
    pairs = drawn((0.4, -1.0, 0.6, 0.02, -0.03, 0.25, 0.0), np.random.default_rng(1), **arguments)
    with pytest.raises(CalibrationRefusedError, match=words):
        align(pairs)
