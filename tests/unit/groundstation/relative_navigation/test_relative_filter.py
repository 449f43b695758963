"""The filter between sightings: truth of its covariance, jumps of the own estimate, outliers, gaps."""

import math

import numpy as np
import pytest

from groundstation.relative_navigation.relative_filter import (
    ACCELERATION_M_S2_RTHZ,
    TURN_RAD_S2_RTHZ,
    OwnMoment,
    RelativeFilter,
)

PERIOD_NS = 66_666_667
COVARIANCE = np.diag((1e-3**2, 1e-3**2, 2e-3**2))


def moment(stamp_ns, way_m=(0.0, 0.0), heading_rad=0.0, velocity_m_s=(0.0, 0.0), rate_rad_s=0.0):
    return OwnMoment(stamp_ns, way_m, heading_rad, velocity_m_s, rate_rad_s)


def flown(rng, steps=60, *, with_turn=True):
    """The other drifts as the filter believes, the own one goes round; normalised squares of the errors."""
    span_s, found, tracker = PERIOD_NS * 1e-9, [], RelativeFilter()
    place, speed = np.array((1.0, 0.3)), np.array((0.03, -0.02))
    heading, rate = 0.5, 0.02
    for step in range(steps):
        t_s = step * span_s
        own_m = np.array((0.2 * math.sin(0.3 * t_s), 0.2 * math.cos(0.3 * t_s)))
        own_m_s = (0.06 * math.cos(0.3 * t_s), -0.06 * math.sin(0.3 * t_s))
        own = moment(step * PERIOD_NS, tuple(own_m), 0.4 * t_s, own_m_s, 0.4)
        turned = np.array(
            ((math.cos(own.heading_rad), math.sin(own.heading_rad)),
             (-math.sin(own.heading_rad), math.cos(own.heading_rad)))
        )  # fmt: skip
        noise = rng.normal(0.0, np.sqrt(np.diag(COVARIANCE)))
        covariance = COVARIANCE.copy()
        turn = heading - own.heading_rad + noise[2]
        if not with_turn:
            turn, covariance[2, 2] = math.nan, math.inf
        assert tracker.take(own, turned @ (place - own_m) + noise[:2], turn, covariance, 0.0) == ""
        now = tracker.at(own)
        off = np.concatenate((now.away_table_m - (place - own_m), now.velocity_table_m_s - speed))
        if step > 15:
            found.append(off @ np.linalg.solve(now.covariance[:4, :4], off) / 4.0)
        push = rng.normal(0.0, ACCELERATION_M_S2_RTHZ / math.sqrt(span_s), 2)
        place = place + speed * span_s + 0.5 * push * span_s**2
        speed = speed + push * span_s
        turn_push = rng.normal(0.0, TURN_RAD_S2_RTHZ / math.sqrt(span_s))
        heading, rate = heading + rate * span_s + 0.5 * turn_push * span_s**2, rate + turn_push * span_s
    return np.mean(found), now, heading


def test_the_errors_are_those_that_the_covariance_states(rng):
    assert np.mean([flown(rng)[0] for _ in range(15)]) == pytest.approx(1.0, abs=0.25)
    _, now, heading = flown(rng)
    assert math.remainder(now.heading_rad - heading, math.tau) == pytest.approx(0.0, abs=0.01)


def test_without_a_heading_places_are_as_good_and_the_heading_stays_unknown(rng):
    squares, now, _ = flown(rng, with_turn=False)
    assert squares < 2.0
    assert math.isnan(now.heading_rad)
    assert now.rate_rad_s == 0.0


def settled(tracker=None):
    tracker = tracker or RelativeFilter()
    for step in range(30):
        tracker.take(moment(step * PERIOD_NS), np.array((1.0, 0.0)), 0.0, COVARIANCE, 0.0)
    return tracker, 30 * PERIOD_NS


def test_a_correction_of_the_own_place_is_no_motion():
    """What is given is the way that the velocity adds up to, so there is nothing to jump."""
    tracker, now_ns = settled()
    there = tracker.at(moment(now_ns, (0.05, 0.0)))  # it went 50 mm towards the other
    assert there.away_table_m == pytest.approx((0.95, 0.0), abs=2e-3)


def test_one_wild_sighting_is_left_out_and_four_are_believed():
    tracker, now_ns = settled()
    for number in range(4):
        refusal = tracker.take(
            moment(now_ns + number * PERIOD_NS), np.array((1.3, 0.0)), 0.0, COVARIANCE, 0.0
        )
        assert refusal == ("it contradicts those before" if number < 3 else "")
    assert tracker.at(moment(now_ns + 3 * PERIOD_NS)).away_table_m == pytest.approx((1.3, 0.0), abs=1e-6)


def test_an_old_sighting_is_refused_and_a_long_gap_begins_anew():
    tracker, now_ns = settled()
    assert tracker.take(moment(0), np.array((1.0, 0.0)), 0.0, COVARIANCE, 0.0)
    assert tracker.at(moment(now_ns + 2_000_000_000)) is None
    later = moment(now_ns + 3_000_000_000)
    assert tracker.take(later, np.array((1.6, 0.0)), 0.0, COVARIANCE, 0.0) == ""
    assert tracker.at(later).away_table_m == pytest.approx((1.6, 0.0))


def test_a_stamp_that_is_uncertain_widens_along_the_drift():
    sure, vague = RelativeFilter(), RelativeFilter()
    for tracker, sigma_s in ((sure, 0.0), (vague, 0.05)):
        tracker.take(moment(0, rate_rad_s=0.5), np.array((1.0, 0.0)), 0.0, COVARIANCE, sigma_s)
    wide, narrow = (tracker.at(moment(0)).covariance for tracker in (vague, sure))
    assert wide[1, 1] > 100 * narrow[1, 1]
    assert wide[0, 0] == pytest.approx(narrow[0, 0])
