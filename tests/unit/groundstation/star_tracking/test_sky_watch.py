"""The watchdog names stars that died, moved, came back or appeared, and no others."""

import numpy as np
import pytest

from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.sky_change import Change
from groundstation.star_tracking.sky_watch import SkyWatch
from groundstation.star_tracking.tracker import StarTracker


class Flight:
    """Flies about under a sky that changes, the watch and the tracker as the node has them."""

    def __init__(self, painter, catalogue, camera, seed=41, p_seen=0.97):
        self.painter, self.p_seen = painter, p_seen
        self.rng = np.random.default_rng(seed)
        self.tracker, self.watch = StarTracker(catalogue, camera), SkyWatch(catalogue, camera)

    def picture(self, stars, lit):
        pose = (self.rng.uniform(1.8, 3.2), self.rng.uniform(1.5, 2.5), self.rng.uniform(-3, 3))
        uv = self.painter.project(*pose, stars)
        inside = np.isfinite(uv).all(axis=1) & lit & (self.rng.random(len(stars)) < self.p_seen)
        inside &= (uv > 5).all(axis=1) & (uv[:, 0] < 634) & (uv[:, 1] < 474)
        uv = uv[inside] + self.rng.normal(0.0, 0.05, (int(inside.sum()), 2))
        n = len(uv)
        covariance = np.tile([0.0025, 0.0, 0.0025], (n, 1))
        return Spots(
            uv[:, 0], uv[:, 1], np.linspace(9, 3, n), covariance, np.ones(n), np.zeros((n, 2)), 10.0, 1.0
        )

    def fly(self, count, stars=None, lit=None):
        """Changes found, and the fixes behind them."""
        stars = self.painter.stars_m if stars is None else stars
        lit = np.ones(len(stars), bool) if lit is None else lit
        changes, fixes = [], []
        for _ in range(count):
            spots = self.picture(stars, lit)
            fix = self.tracker.solve(spots)
            assert isinstance(fix, PictureFix)
            found = self.watch.note(fix, spots)
            if found:
                self.tracker.drop(self.watch.dropped)
            changes += found
            fixes.append(fix)
        return changes, fixes


@pytest.fixture
def flight(painter, catalogue, camera):
    return Flight(painter, catalogue, camera)


@pytest.fixture
def star(painter):
    """A star in the middle of the ceiling."""
    return int(np.argmin(np.hypot(*(painter.stars_m - [2.5, 2.0]).T)))


def names(changes):
    return [(change.change, change.star) for change in changes]


def place_of(change):
    return np.array([change.x_m, change.y_m])


def test_an_unchanged_sky_gives_no_alarm(flight):
    assert flight.fly(80)[0] == []
    assert len(flight.watch.dropped) == 0


def test_a_dead_star_is_named_once_dropped_and_named_again_when_it_shines(flight, painter, catalogue, star):
    lit = np.ones(len(painter.stars_m), bool)
    lit[star] = False
    assert names(flight.fly(60, lit=lit)[0]) == [(Change.DIED, catalogue.ids[star])]
    assert flight.watch.dropped.tolist() == [star]
    assert names(flight.fly(60)[0]) == [(Change.REVIVED, catalogue.ids[star])]
    assert len(flight.watch.dropped) == 0


def test_a_star_that_moves_while_flying_is_named_with_its_new_place_and_no_fix_rests_on_it(
    flight, painter, catalogue, star
):
    moved = painter.stars_m.copy()
    moved[star] += [0.012, -0.009]
    assert flight.fly(40)[0] == []
    changes, _ = flight.fly(40, stars=moved)
    assert names(changes) == [(Change.MOVED, catalogue.ids[star])]
    assert place_of(changes[0]) == pytest.approx(moved[star], abs=3e-4)
    assert flight.watch.dropped.tolist() == [star]
    assert all(star not in fix.star_index for fix in flight.fly(10, stars=moved)[1])
    assert names(flight.fly(40)[0]) == [(Change.RETURNED, catalogue.ids[star])]
    assert any(star in fix.star_index for fix in flight.fly(10)[1])


def test_a_star_that_moves_twice_is_told_twice(flight, painter, star):
    once, twice = painter.stars_m.copy(), painter.stars_m.copy()
    once[star] += [0.012, -0.009]
    twice[star] += [-0.008, 0.016]
    flight.fly(40, stars=once)
    changes, _ = flight.fly(40, stars=twice)
    assert [change.change for change in changes] == [Change.MOVED]
    assert place_of(changes[0]) == pytest.approx(twice[star], abs=3e-4)


@pytest.fixture
def free_place(painter):
    place = np.array([2.53, 2.07])
    while np.hypot(*(painter.stars_m - place).T).min() < 0.06:
        place = place + 0.01
    return place


def test_a_new_light_is_proposed_again_when_known_better_and_withdrawn_when_it_is_gone(
    flight, painter, free_place
):
    changes, _ = flight.fly(120, stars=np.vstack((painter.stars_m, free_place)))
    assert {change.change for change in changes} == {Change.APPEARED}
    sightings = [change.sightings for change in changes]
    assert sightings[:2] == [25, 50]
    for change in changes:
        assert place_of(change) == pytest.approx(free_place, abs=3e-4)
    assert [change.change for change in flight.fly(60)[0]] == [Change.VANISHED]


def test_the_covariance_of_a_new_light_is_true(painter, catalogue, camera, free_place):
    squares = []
    for seed in range(8):
        flight = Flight(painter, catalogue, camera, seed)
        changes, _ = flight.fly(45, stars=np.vstack((painter.stars_m, free_place)))
        error = place_of(changes[0]) - free_place
        xx, xy, yy = changes[0].covariance_m2
        squares.append(error @ np.linalg.solve([[xx, xy], [xy, yy]], error) / 2)
    assert 0.2 < np.mean(squares) < 2.2  # mean of 8 chi-squares of two, halved: 1 sigma is 0.35


def test_flashes_all_over_the_ceiling_are_no_stars(flight, painter):
    rng = np.random.default_rng(5)
    for _ in range(60):
        flashes = rng.uniform((1.0, 1.0), (4.0, 3.0), (12, 2))
        assert flight.fly(1, stars=np.vstack((painter.stars_m, flashes)))[0] == []
