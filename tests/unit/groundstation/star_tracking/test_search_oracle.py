"""The search against its oracle in NumPy: the same stars, the same verdict, the same pose."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.search import oracle_tracker

from groundstation.star_tracking.detection import Spots, detect
from groundstation.star_tracking.fixes import BodyMotion, Mode, NoFix, PictureFix, PosePrior
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker, TrackerSettings

pytestmark = pytest.mark.core


def whole_tracker(catalogue, camera, settings=None):
    """The core's search alone: test_torn_pictures.py is about the check that follows it."""
    return StarTracker(catalogue, camera, replace(settings or TrackerSettings(), tear_nats=inf, tear_px=inf))


BOTH = (whole_tracker, oracle_tracker)


@pytest.fixture(scope="module")
def twins(catalogue, camera):
    return [make(catalogue, camera) for make in BOTH]


def spots_at(uv, rng, sigma_px=0.03):
    """Spots without a picture, their covariances and streaks at random."""
    n = len(uv)
    covariance = np.column_stack(
        (rng.uniform(0.5, 2.0, n), rng.uniform(-0.3, 0.3, n), rng.uniform(0.5, 2.0, n))
    )
    streak = rng.uniform(-2.0, 2.0, (n, 2))
    light = np.linspace(900, 300, n)
    return Spots(
        uv[:, 0].copy(), uv[:, 1].copy(), light, sigma_px**2 * covariance, np.ones(n), streak, 10.0, 1.0
    )


def mixed_sky(painter, rng, stars, lights, sigma_px):
    """Some of the stars in view and some lights that are none, in any order, and where that was."""
    pose = (rng.uniform(0.5, 4.5), rng.uniform(0.5, 3.5), rng.uniform(-np.pi, np.pi))
    seen = rng.permutation(painter.visible(pose))[:stars]
    uv = painter.project(*pose)[seen] + rng.normal(0.0, sigma_px, (len(seen), 2))
    uv = np.concatenate((uv, rng.uniform((1.0, 1.0), (638.0, 478.0), (lights, 2))))
    return spots_at(rng.permutation(uv), rng, sigma_px), pose


def assert_equal(one, two):
    assert type(one) is type(two)
    if isinstance(one, NoFix):
        assert (one.reason, one.detail) == (two.reason, two.detail)
        assert one.evidence_nats == pytest.approx(two.evidence_nats, abs=1e-6)
        assert (one.guess is None) == (two.guess is None)
        return
    assert np.array_equal(one.spot_index, two.spot_index)
    assert np.array_equal(one.star_index, two.star_index)
    assert (one.mode, one.stars) == (two.mode, two.stars)
    off = (one.x_m - two.x_m, one.y_m - two.y_m, np.angle(np.exp(1j * (one.heading_rad - two.heading_rad))))
    assert np.abs(off).max() < 1e-9
    sigma = np.sqrt(np.diag(two.covariance))
    assert np.abs((one.covariance - two.covariance) / np.outer(sigma, sigma)).max() < 1e-6
    assert np.abs(one.residual_m - two.residual_m).max() < 1e-9
    assert one.evidence_nats == pytest.approx(two.evidence_nats, abs=1e-6)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    stars=st.integers(0, 45),
    lights=st.integers(0, 40),
    sigma_px=st.sampled_from([0.02, 0.1, 0.7]),
)
def test_stars_among_strange_lights(painter, twins, seed, stars, lights, sigma_px):
    spots, _ = mixed_sky(painter, np.random.default_rng(seed), stars, lights, sigma_px)
    one, two = (twin.solve(spots) for twin in twins)
    assert_equal(one, two)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), stars=st.integers(3, 20), off=st.floats(0.0, 4.0))
def test_from_a_prior_right_or_wrong(painter, twins, seed, stars, off):
    rng = np.random.default_rng(seed)
    spots, pose = mixed_sky(painter, rng, stars, int(rng.integers(0, 5)), 0.05)
    sigma = np.array([0.01, 0.008, 0.01])
    mean = np.asarray(pose) + off * sigma * rng.normal(size=3)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    prior = PosePrior(*mean, covariance=turn @ np.diag(sigma**2) @ turn.T)
    one, two = (twin.solve(spots, prior) for twin in twins)
    assert_equal(one, two)


@pytest.mark.parametrize("variance", [np.nan, -1e-3])
def test_a_prior_that_is_none_ends_in_lost_in_space(painter, twins, variance):
    spots, pose = mixed_sky(painter, np.random.default_rng(11), 20, 0, 0.03)
    fix = twins[0].solve(spots, PosePrior(*pose, covariance=variance * np.eye(3)))
    assert isinstance(fix, PictureFix)
    assert fix.mode is Mode.LOST_IN_SPACE


@pytest.mark.parametrize("exposure_s", [0.0, 0.01])
@pytest.mark.parametrize("readout_s", [0.0, 0.025])
def test_with_a_known_motion(painter, catalogue, camera, exposure_s, readout_s):
    rng = np.random.default_rng(12)
    rolling = TrackerSettings(exposure_s=exposure_s, readout_s=readout_s)
    twins = [make(catalogue, camera, rolling) for make in BOTH]
    velocity = (0.3, -0.2, 0.5)
    spots = detect(painter.paint(rng, (2.4, 1.8, 0.7), velocity, exposure_s, readout_s))
    one, two = (twin.solve(spots, motion=BodyMotion(*velocity)) for twin in twins)
    assert isinstance(one, PictureFix)
    assert_equal(one, two)


@pytest.mark.parametrize(
    ("velocity", "lights"),
    [((0.0, 0.0, 0.0), 0), ((0.4, 0.3, 0.0), 5), ((0.0, 0.1, 1.2), 0), ((-0.5, 0.2, -0.8), 8)],
)
def test_painted_pictures_sharp_and_blurred(painter, twins, velocity, lights):
    rng = np.random.default_rng(13)
    strangers = [(*rng.uniform((10.0, 10.0), (630.0, 470.0)), 30e3) for _ in range(lights)]
    spots = detect(painter.paint(rng, (2.7, 2.2, -1.1), velocity, 0.033, lights=strangers))
    one, two = (twin.solve(spots) for twin in twins)
    assert isinstance(one, PictureFix)
    assert_equal(one, two)


def test_dropped_stars_are_dropped_by_both_and_come_back(painter, twins):
    spots, _ = mixed_sky(painter, np.random.default_rng(14), 20, 0, 0.03)
    whole = twins[0].solve(spots)
    for twin in twins:
        twin.drop(whole.star_index[:5])
    one, two = (twin.solve(spots) for twin in twins)
    for twin in twins:
        twin.drop(np.zeros(0, np.int64))
    assert_equal(one, two)
    assert not set(whole.star_index[:5]) & set(one.star_index)
    assert_equal(twins[0].solve(spots), whole)


def test_spots_in_one_place_and_far_outside_do_no_harm(painter, twins):
    rng = np.random.default_rng(15)
    spots, _ = mixed_sky(painter, rng, 12, 0, 0.03)
    uv = np.column_stack((spots.u_px, spots.v_px))
    odd = [uv[0], uv[0], uv[1], [-1e9, 1e9], [3e5, -5.0]]
    one, two = (twin.solve(spots_at(np.concatenate((uv, odd)), np.random.default_rng(1))) for twin in twins)
    assert isinstance(one, PictureFix)
    assert_equal(one, two)


def test_nan_among_the_spots_gives_a_fix_without_them_or_none(painter, twins):
    spots, _ = mixed_sky(painter, np.random.default_rng(16), 12, 0, 0.03)
    spots.u_px[3] = np.nan
    fix = twins[0].solve(spots)
    assert isinstance(fix, PictureFix)
    assert 3 not in fix.spot_index
    spots.u_px[:] = np.nan
    assert isinstance(twins[0].solve(spots), NoFix)


def test_more_spots_than_ever_before(painter, twins):
    rng = np.random.default_rng(17)
    spots, _ = mixed_sky(painter, rng, 25, 500, 0.03)
    one, two = (twin.solve(spots) for twin in twins)
    assert_equal(one, two)


@pytest.mark.parametrize("stars", [4, 5, 9])
def test_a_small_sky(camera, stars):
    rng = np.random.default_rng(stars)
    sky = StarCatalogue.from_positions(rng.uniform((0.0, 0.0), (1.2, 0.9), (stars, 2)))
    twins = [make(sky, camera) for make in BOTH]
    spots = spots_at(rng.uniform((10.0, 10.0), (630.0, 470.0), (12, 2)), rng)
    one, two = (twin.solve(spots) for twin in twins)
    assert_equal(one, two)


def test_a_sky_whose_stars_are_farther_apart_than_a_picture_shows(camera):
    sky = StarCatalogue.from_positions(10.0 * np.array([[0, 0], [1, 0], [0, 1], [1, 1.3]]))
    rng = np.random.default_rng(18)
    spots = spots_at(rng.uniform((10.0, 10.0), (630.0, 470.0), (8, 2)), rng)
    for make in BOTH:
        assert isinstance(make(sky, camera).solve(spots), NoFix)


def test_caps_of_work_are_the_same(painter, catalogue, camera):
    rng = np.random.default_rng(19)
    for change in ({"look_ups": 300}, {"candidates": 2}, {"look_ups": 0}, {"pair_spots": 4}):
        tight = replace(TrackerSettings(), **change)
        twins = [make(catalogue, camera, tight) for make in BOTH]
        for stars, lights in ((0, 12), (6, 10), (20, 20)):
            spots, _ = mixed_sky(painter, rng, stars, lights, 0.1)
            one, two = (twin.solve(spots) for twin in twins)
            assert_equal(one, two)


def test_tracking_says_so(painter, twins):
    spots, pose = mixed_sky(painter, np.random.default_rng(20), 10, 0, 0.03)
    fix = twins[0].solve(spots, PosePrior(*pose, covariance=np.diag([1e-4] * 3)))
    assert fix.mode is Mode.TRACKING
