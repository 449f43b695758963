"""Blur and rolling shutter: the pose belongs to the middle of the exposure of the middle row."""

import dataclasses

import numpy as np
import pytest
from oracles.motion import Smear, smear_from_streaks, unbend

from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.fixes import BodyMotion, NoFix, PictureFix, Refusal
from groundstation.star_tracking.tracker import StarTracker, TrackerSettings


def error_mm(fix, pose):
    assert isinstance(fix, PictureFix)
    return 1e3 * np.hypot(fix.x_m - pose[0], fix.y_m - pose[1])


@pytest.mark.parametrize("seed", range(4))
def test_a_blurred_picture_is_solved_to_a_fifth_of_a_millimetre(painter, catalogue, camera, seed):
    rng = np.random.default_rng(seed)
    pose = (rng.uniform(1.5, 3.5), rng.uniform(1.3, 2.7), rng.uniform(-3, 3))
    velocity = (rng.uniform(-0.8, 0.8), rng.uniform(-0.8, 0.8), rng.uniform(-1.2, 1.2))
    image = painter.paint(rng, pose, velocity, exposure_s=0.033)
    fix = StarTracker(catalogue, camera).solve(detect(image))
    assert error_mm(fix, pose) < 0.2


def test_the_rolling_shutter_term_takes_out_what_the_rows_saw_later(painter, catalogue, camera):
    rng = np.random.default_rng(11)
    plain = StarTracker(catalogue, camera, TrackerSettings(tear_px=np.inf))  # else it refuses the worst ones
    aware = StarTracker(catalogue, camera, TrackerSettings(exposure_s=0.005, readout_s=0.025))
    without, with_term = [], []
    for _ in range(6):
        pose = (rng.uniform(1.5, 3.5), rng.uniform(1.3, 2.7), rng.uniform(-3, 3))
        direction, rate = rng.uniform(-np.pi, np.pi), rng.uniform(-1.0, 1.0)
        velocity = (0.5 * np.cos(direction), 0.5 * np.sin(direction), rate)
        spots = detect(painter.paint(rng, pose, velocity, exposure_s=0.005, readout_s=0.025))
        without.append(error_mm(plain.solve(spots), pose))
        with_term.append(error_mm(aware.solve(spots, motion=BodyMotion(*velocity)), pose))
    assert np.sqrt(np.mean(np.square(with_term))) < 0.1
    assert np.sqrt(np.mean(np.square(without))) > 5 * np.sqrt(np.mean(np.square(with_term)))


def test_a_picture_of_foreign_streaks_is_refused_as_blurred(painter, catalogue, camera):
    rng = np.random.default_rng(13)
    elsewhere = rng.uniform((0.0, 0.0), (5.0, 4.0), painter.stars_m.shape)
    strange = dataclasses.replace(painter, stars_m=elsewhere)
    image = strange.paint(rng, (2.5, 2.0, 0.3), (1.2, -0.9, 0.0), exposure_s=0.05)
    answer = StarTracker(catalogue, camera).solve(detect(image))
    assert isinstance(answer, NoFix)
    assert answer.reason is Refusal.BLURRED


@pytest.mark.parametrize("turn", [0.0, 0.04, -0.05])
def test_streaks_tell_the_motion_up_to_its_sign(turn):
    rng = np.random.default_rng(12)
    q = rng.uniform(-1, 1, 30) + 1j * rng.uniform(-0.8, 0.8, 30)
    path = 0.03 - 0.05j
    streak = -1j * turn * q - path
    streak *= rng.choice([-1.0, 1.0], 30)
    jacobian = np.tile(np.eye(2) * 0.0037, (30, 1, 1))
    smear = smear_from_streaks(q, np.stack((streak.real, streak.imag), axis=1) / 0.0037, jacobian)
    sign = np.sign((smear.path_body_m * np.conj(path)).real)
    assert smear.turn_rad * sign == pytest.approx(turn, abs=1e-6)
    assert smear.path_body_m * sign == pytest.approx(path, abs=1e-6)


def test_the_mean_over_an_exposure_is_brought_back_to_its_middle():
    a, b = 0.08, 0.03 + 0.05j
    q = np.array([1.0 + 0.5j, -0.4 + 0.2j])
    times = np.linspace(-0.5, 0.5, 20001)
    # Exact motion in body axes: q(t) = exp(-i a t) (q - b' t), b' turned so that dq/dt = -i a q - b.
    path = np.array([np.exp(-1j * a * t) * (q - b * t) for t in times])
    mean = np.trapezoid(path, times, axis=0)
    assert np.abs(mean - q).max() > 1e-4
    assert np.abs(unbend(mean, Smear(a, b)) - q).max() < 1e-6
