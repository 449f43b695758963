"""A motion model that the frames contradict: it is said, and the covariance holds the bias."""

import numpy as np
import pytest
from oracles import relative_scenes as scenes
from oracles.relative_following import follow

from groundstation.relative_navigation.answers import Reason

TIMES_S = np.arange(0.0, 320.0, 4.0)
WRONG = [[1.86, 1.6, 1.16], [1.16, 1.86, 1.6], [1.0, 1.9, 1.2]]
"""Of a target whose moments are 1.6, 1.16, 1.86."""


@pytest.mark.parametrize("inertia", WRONG)
def test_a_wrong_inertia_is_said_and_widens_the_sigma(inertia):
    found = follow(scenes.Scene(), scenes.leaving(2, TIMES_S), 2, inertia=inertia)
    squares = found.squares()
    assert Reason.CONTRADICTED in {track.reason for track in found.tracks}
    assert squares.mean() < 9.0  # 18 to 23 without
    assert all(part.mean() < 16.0 for part in np.array_split(squares, 4))  # up to 70 without


def test_the_right_inertia_is_never_contradicted():
    for seed in (1, 2, 3):
        found = follow(scenes.Scene(), scenes.leaving(seed, TIMES_S), seed)
        assert {track.reason for track in found.tracks} == {Reason.NONE}
