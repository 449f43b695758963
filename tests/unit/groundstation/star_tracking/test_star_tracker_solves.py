"""The star tracker against pictures painted by an independent projection."""

import cv2
import numpy as np
import pytest

from groundstation.star_tracking.detection import PictureError, Spots, detect
from groundstation.star_tracking.fixes import Mode, NoFix, PictureFix, PosePrior, Refusal
from groundstation.star_tracking.tracker import StarTracker


@pytest.fixture(scope="module")
def tracker(catalogue, camera):
    return StarTracker(catalogue, camera)


def spots_at(uv, sigma_px=0.03):
    """Spots without a picture: centres with a known error."""
    n = len(uv)
    covariance = np.tile([sigma_px**2, 0.0, sigma_px**2], (n, 1))
    return Spots(
        uv[:, 0].copy(),
        uv[:, 1].copy(),
        np.linspace(900, 300, n),
        covariance,
        np.ones(n),
        np.zeros((n, 2)),
        10.0,
        1.0,
    )


def random_pose(rng):
    return rng.uniform(1.2, 3.8), rng.uniform(1.0, 3.0), rng.uniform(-np.pi, np.pi)


def pose_error(fix, pose):
    turn = np.angle(np.exp(1j * (fix.heading_rad - pose[2])))
    return np.array([fix.x_m - pose[0], fix.y_m - pose[1], turn])


def test_a_painted_sky_is_solved_to_a_tenth_of_a_millimetre(painter, tracker):
    rng = np.random.default_rng(1)
    for _ in range(4):
        pose = random_pose(rng)
        fix = tracker.solve(detect(painter.paint(rng, pose)))
        assert isinstance(fix, PictureFix)
        assert fix.mode is Mode.LOST_IN_SPACE
        error = pose_error(fix, pose)
        assert np.hypot(*error[:2]) < 1e-4
        assert abs(error[2]) < np.deg2rad(0.006)


def test_the_matched_stars_are_the_ones_that_were_painted(painter, tracker):
    rng = np.random.default_rng(2)
    pose = random_pose(rng)
    spots = detect(painter.paint(rng, pose))
    fix = tracker.solve(spots)
    uv = painter.project(*pose)[fix.star_index]
    assert np.abs(uv[:, 0] - spots.u_px[fix.spot_index]).max() < 0.5
    assert np.abs(uv[:, 1] - spots.v_px[fix.spot_index]).max() < 0.5


@pytest.mark.parametrize("left", [4, 5, 7, 10])
def test_a_few_stars_scattered_over_the_picture_are_enough(painter, tracker, left):
    rng = np.random.default_rng(left)
    for _ in range(10):
        pose = random_pose(rng)
        seen = rng.permutation(painter.visible(pose))[:left]
        uv = painter.project(*pose)[seen] + rng.normal(0.0, 0.03, (left, 2))
        fix = tracker.solve(spots_at(uv))
        assert isinstance(fix, PictureFix)
        assert np.hypot(*pose_error(fix, pose)[:2]) < 2e-3


@pytest.mark.parametrize(("fewest", "most", "share"), [(4, 4, 0.97), (5, 10, 0.995)])
def test_few_stars_are_nearly_always_identified_and_never_falsely(painter, tracker, fewest, most, share):
    rng, found, pictures = np.random.default_rng(20), 0, 400
    for _ in range(pictures):
        pose, left = random_pose(rng), int(rng.integers(fewest, most + 1))
        seen = rng.permutation(painter.visible(pose))[:left]
        assert len(seen) == left
        fix = tracker.solve(spots_at(painter.project(*pose)[seen] + rng.normal(0.0, 0.03, (left, 2))))
        if isinstance(fix, PictureFix):
            error = pose_error(fix, pose)
            assert np.hypot(*error[:2]) < 2e-3
            assert abs(error[2]) < np.deg2rad(0.1)
            found += 1
    assert found >= share * pictures


def test_three_stars_are_believed_only_with_a_prior(painter, tracker):
    rng = np.random.default_rng(3)
    pose = random_pose(rng)
    seen = rng.permutation(painter.visible(pose))[:3]
    spots = spots_at(painter.project(*pose)[seen] + rng.normal(0.0, 0.03, (3, 2)))
    alone = tracker.solve(spots)
    assert isinstance(alone, NoFix)
    assert alone.reason is Refusal.TOO_FEW_STARS
    prior = PosePrior(pose[0] + 0.01, pose[1] - 0.008, pose[2] + 0.005, np.diag([1e-4, 1e-4, 1e-4]))
    fix = tracker.solve(spots, prior)
    assert isinstance(fix, PictureFix)
    assert fix.mode is Mode.TRACKING
    assert np.hypot(*pose_error(fix, pose)[:2]) < 1e-3


def test_a_wrong_prior_falls_back_to_lost_in_space(painter, tracker):
    rng = np.random.default_rng(4)
    pose = random_pose(rng)
    spots = detect(painter.paint(rng, pose))
    prior = PosePrior(pose[0] + 0.5, pose[1], pose[2] + 1.0, np.diag([1e-4, 1e-4, 1e-4]))
    fix = tracker.solve(spots, prior)
    assert fix.mode is Mode.LOST_IN_SPACE
    assert np.hypot(*pose_error(fix, pose)[:2]) < 1e-4


@pytest.mark.parametrize("lights", [4, 5, 6, 8, 12, 20, 40])
def test_random_lights_are_never_taken_for_the_ceiling(tracker, lights):
    rng = np.random.default_rng(lights)
    for _ in range(25):
        uv = rng.uniform((5.0, 5.0), (634.0, 474.0), (lights, 2))
        answer = tracker.solve(spots_at(uv))
        assert isinstance(answer, NoFix)


def test_the_reported_covariance_is_the_error_s(painter, tracker):
    rng = np.random.default_rng(5)
    ratios = []
    for _ in range(150):
        pose = random_pose(rng)
        seen = painter.visible(pose)
        seen = rng.permutation(seen)[: rng.integers(5, len(seen) + 1)]
        uv = painter.project(*pose)[seen] + rng.normal(0.0, 0.05, (len(seen), 2))
        fix = tracker.solve(spots_at(uv, sigma_px=0.05))
        error = pose_error(fix, pose)
        ratios.append(error @ np.linalg.solve(fix.covariance, error) / 3.0)
    assert 0.8 < np.mean(ratios) < 1.25


def test_a_sky_seen_in_a_mirror_is_refused(painter, tracker):
    rng = np.random.default_rng(6)
    pose = random_pose(rng)
    image = np.ascontiguousarray(painter.paint(rng, pose)[:, ::-1])
    assert isinstance(tracker.solve(detect(image)), NoFix)


@pytest.mark.parametrize(("level", "reason"), [(0, Refusal.NO_SPOTS), (255, Refusal.FLOODED)])
def test_black_and_saturated_pictures_say_why_they_give_no_fix(tracker, level, reason):
    answer = tracker.solve(detect(np.full((480, 640), level, np.uint8)))
    assert isinstance(answer, NoFix)
    assert answer.reason is reason


def test_a_lit_room_is_refused_as_flooded(tracker):
    rng = np.random.default_rng(7)
    image = cv2.resize(rng.integers(0, 255, (24, 32), dtype=np.uint8), (640, 480))
    answer = tracker.solve(detect(image))
    assert isinstance(answer, NoFix)


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((480, 640, 3), np.uint8),
        np.zeros((480, 640), np.uint16),
        np.zeros((8, 8), np.uint8),
    ],
)
def test_what_is_no_grey_picture_is_refused_in_words(image):
    with pytest.raises(PictureError, match="expected"):
        detect(image)


def test_hot_pixels_are_counted_and_not_taken_for_stars(painter):
    rng = np.random.default_rng(8)
    image = painter.paint(rng, (2.5, 2.0, 0.3), lit=np.zeros(len(painter.stars_m), bool))
    spots = detect(image)
    assert len(spots) == 0
    assert spots.hot_pixels == len(painter.hot_pixels)


def test_the_same_picture_gives_the_same_fix_bit_for_bit(painter, tracker):
    rng = np.random.default_rng(9)
    image = painter.paint(rng, (2.2, 1.9, -2.0))
    one, two = tracker.solve(detect(image)), tracker.solve(detect(image))
    assert (one.x_m, one.y_m, one.heading_rad) == (two.x_m, two.y_m, two.heading_rad)
    assert np.array_equal(one.covariance, two.covariance)
