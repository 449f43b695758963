"""Frames followed as published: predicted, matched near, corrected, else propagated; and a stage evolved."""

import numpy as np
import pytest
from oracles import relative_following as following
from oracles import relative_scenes as scenes
from scipy.spatial.transform import Rotation

from groundstation.data_sets.relative_case import case_of
from groundstation.relative_navigation.motion_models import MOTION_MODELS
from groundstation.relative_navigation.precession import AxialInertia, precess
from groundstation.relative_navigation.solvers import SOLVERS
from groundstation.relative_navigation.stage_evolution import search_stage
from groundstation.relative_navigation.stage_spin import LeavingCamera, Stage, StageRun

TIMES = np.arange(0.0, 240.0, 4.0)


def test_every_frame_stands_at_the_bound_of_a_single_one():
    found = following.follow(scenes.Scene(), scenes.leaving(2, TIMES), 7, "published", labelled=False)
    assert found.statuses == ["solved"] * len(TIMES)
    assert 0.85 < found.ratio("position") < 1.15
    assert 0.85 < found.ratio("turn") < 1.15
    assert 4.0 < np.mean(found.squares()) < 8.0


def test_rates_are_differences_of_poses():
    motion = scenes.leaving(2, TIMES)
    found = following.follow(scenes.Scene(), motion, 7, "published")
    assert np.isnan(found.tracks[0].rate_rad_s).all()
    rotations = [track.pose.camera_from_body for track in found.tracks[4:6]]
    turned = Rotation.from_matrix(rotations[0].T @ rotations[1]).as_rotvec() / 4.0
    np.testing.assert_allclose(found.tracks[5].rate_rad_s, turned, atol=1e-12)
    places = [track.pose.position_camera_m for track in found.tracks[4:6]]
    np.testing.assert_allclose(found.tracks[5].velocity_m_s, (places[1] - places[0]) / 4.0, atol=1e-12)


def test_without_points_the_last_motion_goes_on_with_its_errors():
    scene, rng = scenes.Scene(), np.random.default_rng(3)
    motion = scenes.leaving(2, TIMES)
    rows = [row for row in scenes.seen(scene, motion, rng) if row[0] < 30 or row[2] < 3]
    case = case_of(scene.case(guess_frame0=scenes.guess(motion, rng)))
    tracker = MOTION_MODELS["published"](case.settings, SOLVERS["lm"]())
    tracks = [tracker.look(frame) for frame in following.frames_of(rows, scene.sigma_px, True)]
    assert [track.status.value for track in tracks] == ["solved"] * 30 + ["propagated"] * 30
    last = tracks[29]
    for steps in (1, 10, 30):
        track = tracks[29 + steps]
        straight = last.pose.position_camera_m + 4.0 * steps * last.velocity_m_s  # no orbit in this case
        np.testing.assert_allclose(track.pose.position_camera_m, straight, atol=1e-9)
        off = track.pose.position_camera_m - motion.positions_m[29 + steps]
        assert np.linalg.norm(off) < 4.0 * track.sigma_position_m
        turn = Rotation.from_matrix(track.pose.camera_from_body) * motion.rotations[29 + steps].inv()
        assert turn.magnitude() < 4.0 * track.sigma_attitude_rad
    sigmas = [track.sigma_position_m for track in tracks[29:]]
    assert np.all(np.diff(sigmas) > 0.0)
    now, before = (track.covariance[:3, :3] for track in (last, tracks[28]))
    for steps in (1, 10):  # of x29 + steps (x29 - x28)
        exact = (1 + steps) ** 2 * now + steps**2 * before
        np.testing.assert_allclose(tracks[29 + steps].covariance[:3, :3], exact, rtol=1e-6, atol=1e-15)
    assert str(tracks[40].reason.value) == "fewer than four points that span space"


@pytest.mark.parametrize(("eps_px", "is_solved"), [(0.5, False), (4.0, False), (30.0, True)])
def test_nothing_farther_than_eps_from_its_prediction_is_taken(eps_px, is_solved):
    scene, motion = scenes.Scene(), scenes.leaving(2, TIMES[:4])
    found = following.follow(scene, motion, 7, "published", labelled=False, eps_px=eps_px)
    assert all(status == ("solved" if is_solved else "propagated") for status in found.statuses)


def test_without_a_guess_the_target_is_searched_for():
    found = following.follow(scenes.Scene(), scenes.leaving(2, TIMES[:5]), 7, "published", guessed=False)
    assert found.statuses == ["solved"] * 5


STAGE = Stage(
    AxialInertia(2548.0, 14406.0),
    np.array([[-0.35, 1.2, 0.1], [0.0, 0.6, 1.1], [-0.3, -0.7, 1.0], [0.1, -1.2, 0.0], [-0.2, 0.4, -1.1]]),
    LeavingCamera(600.0, 2.5, 1.0),
)


def test_a_generation_precesses_as_each_of_its_members():
    rng = np.random.default_rng(1)
    starts = Rotation.from_rotvec(rng.normal(size=(4, 3))).as_matrix()
    rates, times = rng.normal(0.0, 0.1, (4, 3)), np.array([0.0, 0.7, 5.0])
    found = precess(starts, rates, STAGE.inertia, times)
    for member in range(4):
        exact = precess(starts[member], rates[member], STAGE.inertia, times)
        np.testing.assert_allclose(found[member], exact, atol=1e-12)


def test_evolution_finds_the_rate_of_a_stage():
    """Pixels by integration, without noise."""
    times, rate = np.array([0.0, 0.5, 1.0]), np.radians([-2.5, 1.0, 1.0])
    start = Rotation.from_rotvec([0.05, -0.04, 0.08])
    rotations, _ = scenes.spin(times, start, rate, np.array([2548.0, 14406.0, 14406.0]))
    pixels = []
    for t, rotation in zip(times, rotations, strict=True):
        x, y, z = rotation.apply(STAGE.markers_m).T
        pixels.append(600.0 * np.stack((y, z), axis=1) / (2.5 + t - x)[:, None])
    run = StageRun(np.repeat(times, 5), np.tile(np.arange(5), 3), np.concatenate(pixels))
    found = search_stage(STAGE, run, np.random.default_rng(2))
    np.testing.assert_allclose(np.degrees(found.rate_rad_s), [-2.5, 1.0, 1.0], atol=0.01)
    assert (Rotation.from_matrix(found.start) * start.inv()).magnitude() < 1e-3
    assert found.rms_px < 0.01
    assert 40 * 20 < found.evaluations <= 40 * 301


def test_strays_in_the_place_of_points_give_no_pose_with_a_small_sigma():
    """The nearest centre in the neighbourhood may be a stray: then the pose misses its centres."""
    motion = scenes.leaving(6, np.arange(40) * 0.1, nearest=4.0)
    for seed in (3, 4):
        found = following.follow(
            scenes.Scene(), motion, seed, "published", clutter=150.0, missing=0.15, labelled=False
        )
        assert found.solved.sum() > 20
        assert found.squares()[found.solved].max() < 60.0  # 31; 1700 by the covariance of the pose alone
