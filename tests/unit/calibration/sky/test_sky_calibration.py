"""The lens and the mount found from the stars themselves."""

import dataclasses

import numpy as np
import pytest

from calibration.sky.self_calibration import (
    SkyCalibrationError,
    calibrate_intrinsics,
    calibrate_mount,
)
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.tracker import StarTracker


def pictures(painter, rng, poses, sigma_px=0.02):
    made = []
    for pose in poses:
        seen = rng.permutation(painter.visible(pose))
        uv = painter.project(*pose)[seen] + rng.normal(0.0, sigma_px, (len(seen), 2))
        n = len(uv)
        covariance = np.tile([sigma_px**2, 0.0, sigma_px**2], (n, 1))
        made.append(
            Spots(
                uv[:, 0], uv[:, 1], np.linspace(9, 3, n), covariance, np.ones(n), np.zeros((n, 2)), 10.0, 1.0
            )
        )
    return made


def turning(count, rng, wobble_m=5e-5):
    middle = np.array([2.45, 1.95, 0.0])
    poses = np.tile(middle, (count, 1)) + rng.normal(0.0, wobble_m, (count, 3))
    poses[:, 2] = np.linspace(0.4, 0.4 + 2 * np.pi, count)
    return poses


def test_a_wrong_lens_without_distortion_is_put_right_by_the_stars(painter, catalogue, camera):
    rng = np.random.default_rng(31)
    seen = pictures(painter, rng, turning(24, rng))
    wrong = dataclasses.replace(
        camera, fx=580.0, fy=580.0, cx=319.5, cy=239.5, distortion=(0.0, 0.0, 0.0, 0.0, 0.0)
    )
    found = calibrate_intrinsics(seen, catalogue, wrong, wobble_sigma_m=5e-5)
    assert len(found.solved) == 24
    assert found.adjusted.rms_px < 0.03
    assert found.camera.fx == pytest.approx(camera.fx, abs=0.1)
    assert found.camera.cx == pytest.approx(camera.cx, abs=0.05)
    true, ours = StarTracker(catalogue, camera), StarTracker(catalogue, found.camera)
    errors = []
    for pose in rng.uniform((1.3, 1.2, -3), (3.7, 2.8, 3), (20, 3)):
        spots = pictures(painter, rng, [pose])[0]
        one, two = true.solve(spots), ours.solve(spots)
        errors.append([np.hypot(f.x_m - pose[0], f.y_m - pose[1]) for f in (one, two)])
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    assert rms[1] < 3e-5 + rms[0]


def test_the_mount_comes_from_turning_in_place_and_its_yaw_from_one_heading(painter, catalogue, camera):
    rng = np.random.default_rng(32)
    seen = pictures(painter, rng, turning(24, rng))
    wrong = dataclasses.replace(
        camera,
        mount_offset_body_m=(0.0, 0.0, 0.0),
        mount_yaw_rad=0.0,
        mount_tilt_x_rad=0.0,
        mount_tilt_y_rad=0.0,
        ceiling_height_above_camera_m=2.25,
    )
    found = calibrate_mount(seen, catalogue, wrong, wobble_sigma_m=5e-5, first_heading_rad=0.4).camera
    assert found.mount_yaw_rad == pytest.approx(camera.mount_yaw_rad, abs=2e-3)
    assert found.mount_offset_body_m[:2] == pytest.approx(camera.mount_offset_body_m[:2], abs=5e-4)
    assert np.allclose(found.body_from_camera(), camera.body_from_camera(), atol=2e-3)
    assert found.ceiling_height_above_camera_m == pytest.approx(2.3, abs=5e-4)


def test_pictures_that_do_not_suffice_are_refused_in_words(painter, catalogue, camera):
    rng = np.random.default_rng(33)
    few = pictures(painter, rng, turning(24, rng)[:6])
    with pytest.raises(SkyCalibrationError, match="a turn of"):
        calibrate_mount(few, catalogue, camera)
    with pytest.raises(SkyCalibrationError, match="could be solved"):
        calibrate_mount(few[:2], catalogue, camera)
