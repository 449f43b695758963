"""Rests found in a recording between being tilted, turned, knocked and carried."""

import numpy as np
import pytest

from calibration.imu.rest_search import find_rests

RATE = 100.0
SIGMA = np.array([6.7e-4, 6.5e-4, 6.5e-4])


def recording(rng, parts):
    """Readings of parts (length s, ax, ay, what happens), white noise on top."""
    rows = []
    for length_s, ax, ay, moves in parts:
        n = round(length_s * RATE)
        part = np.tile([0.01, ax, ay], (n, 1)) + SIGMA * rng.normal(size=(n, 3))
        if moves == "carried":
            part += 0.2 * rng.normal(size=(n, 3))
        if moves == "turned":
            part[:, 0] += 0.3
        if moves == "knocked":
            part[n // 2 : n // 2 + 10, 1:] += 0.3 * rng.normal(size=(10, 2))
        rows.append(part)
    readings = np.vstack(rows)
    return (1 + np.arange(len(readings))) / RATE, readings


def test_each_tilt_is_a_rest_of_its_own_and_a_knock_ends_none():
    parts = [
        (6.0, 0.0, 0.0, ""), (2.0, 0.1, 0.0, "carried"), (5.0, 0.2, 0.0, "knocked"),
        (3.0, 0.2, 0.0, "turned"), (6.0, 0.0, 0.2, ""), (1.0, 0.0, 0.2, "carried"), (1.5, 0.0, 0.3, ""),
    ]  # fmt: skip
    found = find_rests(*recording(np.random.default_rng(1), parts), 3.0)
    wanted = [(0.0, 6.0), (8.0, 13.0), (16.0, 22.0)]
    assert len(found) == len(wanted)
    assert np.allclose(found, wanted, atol=0.3)


def test_a_change_of_tilt_too_quick_to_be_seen_moving_still_ends_a_rest():
    t, readings = recording(np.random.default_rng(2), [(5.0, 0.0, 0.0, ""), (5.0, 3e-3, 0.0, "")])
    found = find_rests(t, readings, 3.0)
    assert np.allclose(found, [(0.0, 5.0), (5.0, 10.0)], atol=0.3)


def test_nothing_is_found_where_nothing_rests():
    t, readings = recording(np.random.default_rng(3), [(9.0, 0.0, 0.0, "carried")])
    assert find_rests(t, readings, 3.0, 5.0 * SIGMA) == []
    with pytest.raises(ValueError, match="packets"):
        find_rests(np.arange(3.0), np.zeros((3, 3)), 1.0)
