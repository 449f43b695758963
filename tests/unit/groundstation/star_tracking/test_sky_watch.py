"""The watchdog names stars that died, moved or appeared, and no others."""

import numpy as np
import pytest

from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import StarFix
from groundstation.star_tracking.sky_watch import Change, SkyWatch
from groundstation.star_tracking.tracker import StarTracker


def flight(painter, catalogue, camera, count, stars_m=None, lit=None, seed=41, p_seen=0.97):
    """Changes found while flying about under a (changed) sky."""
    rng = np.random.default_rng(seed)
    tracker, watch = StarTracker(catalogue, camera), SkyWatch(catalogue, camera)
    stars = painter.stars_m if stars_m is None else stars_m
    lit = np.ones(len(stars), bool) if lit is None else lit
    changes = []
    for _ in range(count):
        pose = (rng.uniform(1.8, 3.2), rng.uniform(1.5, 2.5), rng.uniform(-3, 3))
        uv = painter.project(*pose, stars)
        inside = np.isfinite(uv).all(axis=1) & lit & (rng.random(len(stars)) < p_seen)
        inside &= (uv > 5).all(axis=1) & (uv[:, 0] < 634) & (uv[:, 1] < 474)
        uv = uv[inside] + rng.normal(0.0, 0.05, (int(inside.sum()), 2))
        n = len(uv)
        cov = np.tile([0.0025, 0.0, 0.0025], (n, 1))
        spots = Spots(uv[:, 0], uv[:, 1], np.linspace(9, 3, n), cov, np.ones(n), np.zeros((n, 2)), 10.0, 1.0)
        fix = tracker.solve(spots)
        assert isinstance(fix, StarFix)
        changes += watch.note(fix, spots)
    return changes, watch


def middle_star(painter):
    return int(np.argmin(np.hypot(*(painter.stars_m - [2.5, 2.0]).T)))


def test_an_unchanged_sky_gives_no_alarm(painter, catalogue, camera):
    changes, watch = flight(painter, catalogue, camera, 80)
    assert changes == []
    assert len(watch.dead) == 0


def test_a_dead_star_is_named_once(painter, catalogue, camera):
    star = middle_star(painter)
    lit = np.ones(len(painter.stars_m), bool)
    lit[star] = False
    changes, watch = flight(painter, catalogue, camera, 60, lit=lit)
    assert [(c.change, c.star) for c in changes] == [(Change.DIED, catalogue.ids[star])]
    assert watch.dead.tolist() == [star]


def test_a_moved_star_is_named_with_its_new_place(painter, catalogue, camera):
    star = middle_star(painter)
    moved = painter.stars_m.copy()
    moved[star] += [0.012, -0.009]
    changes, _ = flight(painter, catalogue, camera, 60, stars_m=moved)
    assert [(c.change, c.star) for c in changes] == [(Change.MOVED, catalogue.ids[star])]
    assert (changes[0].x_m, changes[0].y_m) == pytest.approx(tuple(moved[star]), abs=1e-3)


def test_a_new_light_that_stays_is_proposed_with_its_place(painter, catalogue, camera):
    place = np.array([2.53, 2.07])
    while np.hypot(*(painter.stars_m - place).T).min() < 0.06:
        place = place + 0.01
    changes, _ = flight(painter, catalogue, camera, 80, stars_m=np.vstack((painter.stars_m, place)))
    assert [c.change for c in changes] == [Change.APPEARED]
    assert (changes[0].x_m, changes[0].y_m) == pytest.approx(tuple(place), abs=1e-3)
