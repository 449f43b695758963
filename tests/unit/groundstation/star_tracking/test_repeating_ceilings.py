"""A ceiling that looks the same in several places: what no picture can tell is not told."""

import numpy as np
import pytest
from oracles.search import oracle_tracker

from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import NoFix, PictureFix, PosePrior, Refusal
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker


def rows_and_columns(jitter_m):
    rng = np.random.default_rng(1)
    grid = np.stack(np.meshgrid(0.35 * np.arange(15), 0.35 * np.arange(12)), axis=-1).reshape(-1, 2)
    return grid + rng.normal(0.0, jitter_m, grid.shape)


def spots_of(painter, rng, stars_m, pose):
    uv = painter.project(*pose, stars_m)
    inside = (uv > 4.0).all(axis=1) & (uv < (635.0, 475.0)).all(axis=1)
    uv = uv[inside] + rng.normal(0.0, 0.03, (int(inside.sum()), 2))
    n = len(uv)
    covariance = np.tile([0.03**2, 0.0, 0.03**2], (n, 1))
    light = np.linspace(900, 300, n)
    return Spots(uv[:, 0].copy(), uv[:, 1].copy(), light, covariance, np.ones(n), np.zeros((n, 2)), 10.0, 1.0)


@pytest.mark.parametrize("make", [StarTracker, oracle_tracker])
def test_rows_and_columns_of_leds_are_refused_in_words(painter, camera, make):
    rng, stars = np.random.default_rng(2), rows_and_columns(0.0)
    tracker = make(StarCatalogue.from_positions(stars), camera)
    for _ in range(5):
        pose = (rng.uniform(1.5, 3.5), rng.uniform(1.3, 2.5), rng.uniform(-np.pi, np.pi))
        spots = spots_of(painter, rng, stars, pose)
        answer = tracker.solve(spots)
        assert isinstance(answer, NoFix)
        assert answer.reason is Refusal.NO_CONSENSUS
        assert "More than one place" in answer.detail
        assert answer.guess is not None
        # What is believed beforehand may decide between the places.
        fix = tracker.solve(spots, PosePrior(*pose, covariance=np.diag([1e-4] * 3)))
        assert isinstance(fix, PictureFix)


@pytest.mark.parametrize("make", [StarTracker, oracle_tracker])
def test_leds_a_few_millimetres_out_of_line_tell_the_places_apart(painter, camera, make):
    rng, stars = np.random.default_rng(3), rows_and_columns(0.005)
    tracker = make(StarCatalogue.from_positions(stars), camera)
    for _ in range(10):
        pose = (rng.uniform(1.5, 3.5), rng.uniform(1.3, 2.5), rng.uniform(-np.pi, np.pi))
        fix = tracker.solve(spots_of(painter, rng, stars, pose))
        assert isinstance(fix, PictureFix)
        assert np.hypot(fix.x_m - pose[0], fix.y_m - pose[1]) < 1e-3
