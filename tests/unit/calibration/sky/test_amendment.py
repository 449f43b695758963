"""Proposals of the watchdog applied to a star list: the last word counts, nothing else changes."""

import math

import pytest

from calibration.sky.amendment import AmendmentError, propose
from groundstation.star_tracking.sky_change import Change, SkyChange

NAMES = ("0", "1", "2", "3", "n5")


def say(change, star="", x=1.0, y=2.0, sigma=1e-4, sightings=100):
    return SkyChange(change, star, x, y, (sigma**2, 0.0, sigma**2), sightings)


def summed(*found, min_sightings=50):
    by_alpha = [one if isinstance(one, tuple) else ("alpha", one) for one in found]
    return propose(NAMES, by_alpha, min_sightings)


def test_what_died_is_struck_off_unless_it_shines_again():
    assert summed(say(Change.DIED, "1"), say(Change.DIED, "2"), say(Change.REVIVED, "1")).struck == ("2",)


def test_what_moved_hangs_at_its_last_place_unless_it_returned():
    found = summed(
        say(Change.MOVED, "1", x=1.1),
        say(Change.MOVED, "1", x=1.2),
        say(Change.MOVED, "2"),
        say(Change.RETURNED, "2"),
        say(Change.MOVED, "3", x=3.3),
        say(Change.DIED, "3"),
        say(Change.REVIVED, "3"),
    )
    assert [(star.name, star.x_m) for star in found.moved] == [
        ("1", pytest.approx(1.2)),
        ("3", pytest.approx(3.3)),
    ]
    assert found.struck == ()


def test_a_light_is_added_once_with_its_best_place_and_a_number_of_its_own():
    found = summed(
        say(Change.APPEARED, x=4.001, sightings=25),
        say(Change.APPEARED, x=4.0, sightings=60),
        say(Change.APPEARED, x=5.0, sightings=60),
        say(Change.VANISHED, x=5.0, sightings=70),
        say(Change.APPEARED, x=6.0, sightings=25),
    )
    (star,) = found.added
    assert (star.name, star.x_m, star.times_seen) == ("4", pytest.approx(4.0), 60)


def test_two_finders_are_averaged_by_their_covariances():
    (star,) = summed(
        ("alpha", say(Change.APPEARED, x=4.0, sigma=1e-4)),
        ("bravo", say(Change.APPEARED, x=4.001, sigma=2e-4)),
    ).added
    assert star.x_m == pytest.approx(4.0002)
    assert star.sigma_x_m == pytest.approx(1e-4 * math.sqrt(0.8))
    assert star.times_seen == 200


def test_a_star_that_is_not_listed_is_refused_by_name():
    with pytest.raises(AmendmentError, match="'77'"):
        summed(say(Change.DIED, "77"))
