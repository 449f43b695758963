"""Streaks of every length: their centres err by no more than the light allows, and say so."""

import numpy as np
import pytest
from scipy.special import ndtr

from groundstation.star_tracking.detection import Detector
from groundstation.star_tracking.tracker import StarTracker

SHAPE = (480, 640)
WIDTH_PX, FLUX_DN, BACKGROUND_DN, READ_DN, GAIN_DN = 1.23, 1600.0, 10.0, 1.25, 0.05
GRID_PX = 80.0
PICTURES = 12


def line_dn(shape, u, v, length, angle):
    """Light of a line of this length, blurred by a Gaussian."""
    rows, columns = np.indices(shape, dtype=float)
    c, s = np.cos(angle), np.sin(angle)
    along, across = (columns - u) * c + (rows - v) * s, (rows - v) * c - (columns - u) * s
    ends = ndtr((along + 0.5 * length) / WIDTH_PX) - ndtr((along - 0.5 * length) / WIDTH_PX)
    side = np.exp(-0.5 * (across / WIDTH_PX) ** 2) / (WIDTH_PX * np.sqrt(2.0 * np.pi))
    return FLUX_DN * ends / length * side


def bound_px2(length, angle):
    """Least covariance (2, 2) of the centre, the light being unknown, mean over places within a pixel."""
    step, size = 1e-3, 64
    found = []
    for u, v in ((32.0, 32.0), (32.5, 32.0), (32.0, 32.5), (32.5, 32.5)):
        light = line_dn((size, size), u, v, length, angle)
        slopes = [
            (
                line_dn((size, size), u + step * du, v + step * dv, length, angle)
                - line_dn((size, size), u - step * du, v - step * dv, length, angle)
            )
            / (2 * step)
            for du, dv in ((1, 0), (0, 1))
        ]
        slope = np.stack([*slopes, light / FLUX_DN]).reshape(3, -1)
        weight = 1.0 / (READ_DN**2 + 1.0 / 12.0 + GAIN_DN * (BACKGROUND_DN + light.ravel()))
        found.append(np.linalg.inv((slope * weight) @ slope.T)[:2, :2])
    return np.mean(found, axis=0)


def errors_px(find, rng, length, angle):
    """Errors (n, 2) of the centres of many such streaks, their squares over the stated covariance, and the
    streaks that were found (n, 2)."""
    errors, squares, streaks = [], [], []
    for _ in range(PICTURES):
        grid = np.stack(
            np.meshgrid(np.arange(60.0, 600.0, GRID_PX), np.arange(50.0, 450.0, GRID_PX)), axis=-1
        )
        places = grid.reshape(-1, 2) + rng.uniform(-5.0, 5.0, (grid.size // 2, 2))
        light = np.full(SHAPE, BACKGROUND_DN)
        for u, v in places:
            left, top = int(u) - 32, int(v) - 32
            light[top : top + 64, left : left + 64] += line_dn((64, 64), u - left, v - top, length, angle)
        noise = rng.normal(0.0, 1.0, SHAPE) * np.sqrt(READ_DN**2 + GAIN_DN * light)
        spots = find(np.clip(np.rint(light + noise), 0, 255).astype(np.uint8))
        far = np.hypot(spots.u_px - places[:, :1], spots.v_px - places[:, 1:])
        assert len(spots) == len(places)
        own = far.argmin(axis=1)
        error = np.stack((spots.u_px, spots.v_px), axis=1)[own] - places
        uu, uv, vv = spots.covariance_px2[own].T
        covariance = np.stack((uu, uv, uv, vv), axis=1).reshape(-1, 2, 2)
        errors.append(error)
        squares.append(np.einsum("ni,ni->n", error, np.linalg.solve(covariance, error[..., None])[..., 0]))
        streaks.append(spots.streak_px[own])
    return np.concatenate(errors), np.concatenate(squares), np.concatenate(streaks)


@pytest.mark.parametrize("length", [2.5, 3.5, 5.0, 8.0, 13.0, 22.0])
@pytest.mark.parametrize("angle", [0.3, 1.2, -0.9])
def test_a_streak_s_centre_is_within_a_tenth_of_its_bound(length, angle):
    errors, squares, streaks = errors_px(Detector().find, np.random.default_rng(1), length, angle)
    assert len(errors) == 35 * PICTURES
    ratio = np.sqrt(np.mean(errors**2, axis=0).sum() / np.trace(bound_px2(length, angle)))
    assert 0.9 < ratio < 1.1
    assert np.abs(errors.mean(axis=0)).max() < 0.02
    assert 1.6 < squares.mean() < 2.4  # of two unknowns, and of 420 such streaks
    streak = np.array([np.cos(angle), np.sin(angle)]) * length
    off = streaks * np.where(streaks @ streak < 0.0, -1.0, 1.0)[:, None] - streak
    assert np.abs(np.median(off, axis=0)).max() < 0.35


def test_standing_stars_beside_one_oblong_lamp_are_still_round(painter):
    image = painter.paint(np.random.default_rng(3), (2.5, 2.0, 0.4))
    lamp = line_dn((64, 64), 32.0, 32.0, 18.0, 0.5)
    image[100:164, 200:264] = np.clip(image[100:164, 200:264] + lamp, 0, 255).astype(np.uint8)
    spots = Detector().find(image)
    oblong = np.hypot(spots.streak_px[:, 0], spots.streak_px[:, 1]) > 0.0
    at_lamp = np.hypot(spots.u_px - 232.0, spots.v_px - 132.0) < 2.0
    assert at_lamp.sum() == 1
    assert oblong[at_lamp].all()
    assert oblong.sum() < 0.15 * len(spots)


@pytest.mark.parametrize(("speed_m_s", "turn_rad_s"), [(0.3, 0.4), (0.8, 1.2), (1.2, 0.0), (0.0, 2.0)])
def test_the_covariance_of_blurred_pictures_is_true(painter, catalogue, camera, speed_m_s, turn_rad_s):
    rng, tracker, find = np.random.default_rng(4), StarTracker(catalogue, camera), Detector().find
    squares = []
    for _ in range(12):
        pose = (rng.uniform(1.5, 3.5), rng.uniform(1.3, 2.7), rng.uniform(-3, 3))
        way = rng.uniform(-np.pi, np.pi)
        velocity = (speed_m_s * np.cos(way), speed_m_s * np.sin(way), turn_rad_s * rng.choice([-1.0, 1.0]))
        fix = tracker.solve(find(painter.paint(rng, pose, velocity, exposure_s=0.033)))
        error = np.subtract((fix.x_m, fix.y_m, fix.heading_rad), pose)
        error[2] = np.angle(np.exp(1j * error[2]))
        squares.append(float(error @ np.linalg.solve(fix.covariance, error)))
    assert 1.5 < np.mean(squares) < 5.0
    assert max(squares) < 25.0
