"""Surveying a ceiling and calibrating a camera from it, against skies whose truth is known."""

import dataclasses

import numpy as np
import pytest

from calibration.sky.sky_adjustment import (
    HEIGHT,
    OFFSET,
    TILT,
    Observations,
    PosePriorTerm,
    StarPrior,
    adjust,
    project,
)
from calibration.sky.survey.surveyed_sky import LENS, Anchor, SurveyError, survey
from groundstation.star_tracking.detection import Spots


def spots_at(uv, sigma_px):
    n = len(uv)
    covariance = np.tile([sigma_px**2, 0.0, sigma_px**2], (n, 1))
    return Spots(
        uv[:, 0], uv[:, 1], np.linspace(900, 300, n), covariance, np.ones(n), np.zeros((n, 2)), 10.0, 1.0
    )


def sweep(painter, rng, sigma_px=0.03, drop=0.05, lights=2):
    """A lawn-mower sweep: poses, pictures as spots, and which star each spot is."""
    poses, pictures, names = [], [], []
    heading = 0.3
    for line, y in enumerate((0.9, 1.7, 2.4, 3.1)):
        xs = np.linspace(0.8, 4.2, 9)
        for x in xs if line % 2 == 0 else xs[::-1]:
            heading += 0.15
            pose = (x + rng.normal(0, 0.02), y + rng.normal(0, 0.02), heading)
            seen = painter.visible(pose)
            seen = rng.permutation(seen[rng.random(len(seen)) > drop])
            uv = painter.project(*pose)[seen] + rng.normal(0.0, sigma_px, (len(seen), 2))
            uv = np.vstack((uv, rng.uniform((5, 5), (634, 474), (lights, 2))))
            poses.append(pose)
            pictures.append(spots_at(uv, sigma_px))
            names.append(seen)
    return np.array(poses), pictures, names


def anchors_of(painter, pictures, names, rng, tape_m=1e-3):
    picked = []
    for frame in (3, 16, 30):
        star = int(names[frame][0])
        at = painter.stars_m[star] + rng.normal(0.0, tape_m, 2)
        click = (pictures[frame].u_px[0] + 2.0, pictures[frame].v_px[0] - 1.5)
        picked.append(Anchor(f"a{frame}", at[0], at[1], frame, *click))
    return picked


def test_a_sweep_gives_the_shape_of_the_sky_and_says_how_well(painter, camera):
    rng = np.random.default_rng(21)
    _, pictures, names = sweep(painter, rng)
    wrong = camera.with_height(1.1 * camera.ceiling_height_above_camera_m)
    sky = survey(pictures, anchors_of(painter, pictures, names, rng), wrong)
    found, true = sky.star_m @ [1, 1j], painter.stars_m @ [1, 1j]
    distance = np.abs(found[:, None] - true)
    real = distance.min(axis=1) < 0.02
    assert real.sum() > 0.9 * len(true)
    assert real.mean() > 0.97
    goal = true[distance.argmin(axis=1)][real]
    centred = found[real] - found[real].mean()
    factor = ((goal - goal.mean()) * np.conj(centred)).sum() / (np.abs(centred) ** 2).sum()
    error = factor * centred - (goal - goal.mean())
    assert np.sqrt(np.mean(np.abs(error) ** 2)) < 1.5e-4
    normalised = np.column_stack((error.real, error.imag)) / sky.sigma_m[real]
    assert 0.75 < np.sqrt(np.mean(normalised**2)) < 1.3
    assert sky.camera.ceiling_height_above_camera_m == pytest.approx(2.3, rel=2e-3)
    assert {"a3", "a16", "a30"} <= set(sky.ids)


def test_a_sweep_calibrates_the_lens_as_well_from_no_distortion_at_all(painter, camera):
    rng = np.random.default_rng(24)
    _, pictures, names = sweep(painter, rng, lights=0)
    rough = dataclasses.replace(camera, fx=590.0, fy=590.0, distortion=(0.0, 0.0, 0.0, 0.0, 0.0))
    sky = survey(pictures, anchors_of(painter, pictures, names, rng), rough, free=LENS)
    assert sky.adjusted.rms_px < 0.04
    ratio = camera.fy / camera.fx
    assert sky.camera.fy / sky.camera.fx == pytest.approx(ratio, abs=2e-4)
    # The scale of distortion goes with the focal length that was held.
    assert sky.camera.distortion[0] == pytest.approx(camera.distortion[0] * (590.0 / 598.0) ** 2, abs=2e-3)


def test_anchors_that_cannot_fix_the_table_are_refused_in_words(painter, camera):
    rng = np.random.default_rng(22)
    _, pictures, names = sweep(painter, rng)
    anchors = anchors_of(painter, pictures, names, rng)
    with pytest.raises(SurveyError, match="at least two"):
        survey(pictures, anchors[:1], camera)
    with pytest.raises(SurveyError, match="clicked on one star"):
        survey(pictures, [anchors[0], dataclasses.replace(anchors[0], name="b")], camera)
    with pytest.raises(SurveyError, match="no star within"):
        survey(pictures, [dataclasses.replace(a, u_px=-100.0) for a in anchors], camera)
    with pytest.raises(SurveyError, match="overlap"):
        survey([pictures[0], spots_at(np.zeros((0, 2)), 0.1)], anchors, camera)


def known_sky(painter, rng, poses, sigma_px=0.03):
    frame, star, pixel = [], [], []
    for number, pose in enumerate(poses):
        seen = painter.visible(pose)
        frame.append(np.full(len(seen), number))
        star.append(seen)
        pixel.append(painter.project(*pose)[seen] + rng.normal(0.0, sigma_px, (len(seen), 2)))
    frame, star, pixel = np.concatenate(frame), np.concatenate(star), np.concatenate(pixel)
    count = len(painter.stars_m)
    known = StarPrior(np.arange(count), painter.stars_m, np.full(count, 1e-5))
    return Observations(frame, star, pixel, np.full(len(frame), sigma_px)), known


def test_turning_in_place_gives_the_mount_s_offset_and_tilt(painter, camera):
    rng = np.random.default_rng(23)
    poses = np.array([(2.4, 1.9, h) for h in np.linspace(0.0, 2 * np.pi, 24)])
    seen, known = known_sky(painter, rng, poses)
    guess = dataclasses.replace(
        camera, mount_offset_body_m=(0.0, 0.0, 0.0), mount_tilt_x_rad=0.0, mount_tilt_y_rad=0.0
    )
    found = adjust(
        guess,
        poses + rng.normal(0.0, 0.003, poses.shape),
        painter.stars_m,
        seen,
        free=(*OFFSET, *TILT, *HEIGHT),
        known=known,
        in_place=PosePriorTerm(1e-5),
    )
    assert found.camera.mount_offset_body_m[:2] == pytest.approx(camera.mount_offset_body_m[:2], abs=3e-4)
    assert found.camera.mount_tilt_x_rad == pytest.approx(camera.mount_tilt_x_rad, abs=2e-4)
    assert found.camera.mount_tilt_y_rad == pytest.approx(camera.mount_tilt_y_rad, abs=2e-4)
    for name, true in (("mount_tilt_x_rad", camera.mount_tilt_x_rad), ("mount_offset_x_m", 0.02)):
        value = found.camera.mount_tilt_x_rad if "tilt" in name else found.camera.mount_offset_body_m[0]
        assert abs(value - true) < 4 * found.sigma_camera[name]


def test_our_projection_is_opencv_s(painter, camera):
    pose = np.array([2.1, 1.7, 0.8])
    pixel, _ = project(camera, np.tile(pose, (len(painter.stars_m), 1)), painter.stars_m)
    theirs = painter.project(*pose)
    inside = np.isfinite(theirs).all(axis=1)
    assert np.abs(pixel - theirs)[inside].max() < 1e-9


def test_the_derivatives_are_those_of_finite_differences(painter, camera):
    pose = np.tile([2.1, 1.7, 0.8], (6, 1))
    star = painter.stars_m[painter.visible(pose[0])][:6]
    _, by_flat = project(camera, pose, star)
    step = 1e-6
    c, s = np.cos(0.8), np.sin(0.8)
    for axis in range(2):
        move = step * np.array([[c, s], [-s, c]])[axis]  # along body x, then y
        numeric = (project(camera, pose, star + move)[0] - project(camera, pose, star - move)[0]) / (2 * step)
        assert np.abs(numeric - by_flat[:, :, axis]).max() < 1e-3
