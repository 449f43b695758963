"""From pictures to centres: accuracy on rendered tips, antennas, colours, and pictures that are none."""

import cv2
import numpy as np
import pytest
from oracles import relative_pictures as pictures
from oracles import relative_scenes as scenes
from scipy.spatial.transform import Rotation

from groundstation.relative_navigation.colours import train
from groundstation.relative_navigation.intensity import background_of, normalised
from groundstation.relative_navigation.spots import SpotFinder, SpotSettings, Trouble, look_for_spots


def errors(rng, distance, frames, settings=None, finder=None):
    """Errors of centres (n, 2) and their squares in sigmas over frames of six tips of 24 mm."""
    off, squares = [], []
    for _ in range(frames):
        rotation = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3))
        scene = scenes.Scene(points_m=scenes.CUBE * min(1.0, distance / 5.0))
        pixels, radii = pictures.tips(scene, rotation, np.array([0.01, -0.01, 1.0]) * distance, 0.024)
        picture = pictures.paint(pixels, radii, rng, (400, 480) if distance < 0 else (640, 480))
        seen = finder.look(picture) if finder else look_for_spots(picture, settings or SpotSettings())
        assert len(seen.centres) == 6
        gaps = np.linalg.norm(pixels[:, None] - seen.centres.pixels[None], axis=2)
        for row, found in enumerate(gaps.argmin(axis=1)):
            error = seen.centres.pixels[found] - pixels[row]
            off.append(error)
            squares.append(error @ np.linalg.solve(seen.centres.covariances[found], error))
    return np.array(off), np.array(squares)


@pytest.mark.parametrize(("distance", "limit_px"), [(3.0, 0.015), (8.0, 0.03), (12.0, 0.05), (15.0, 0.1)])
def test_centres_of_rendered_tips_are_as_good_as_the_issue_asks(rng, distance, limit_px):
    off, squares = errors(rng, distance, 5)
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < limit_px
    assert 0.3 < np.mean(squares) / 2.0 < 2.5


def test_a_finder_that_saw_the_tips_near_knows_them_better_far_away(rng):
    finder = SpotFinder()
    errors(rng, 4.0, 1, finder=finder)
    off, _ = errors(rng, 15.0, 5, finder=finder)
    assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 0.045


def test_the_published_contour_mean_is_as_coarse_as_the_reference_measured(rng):
    off, _ = errors(rng, 10.0, 5, SpotSettings(method="contour"))
    assert 0.08 < np.sqrt(np.mean(off**2)) < 0.25


def test_background_and_noise_are_read_from_the_picture(rng):
    picture = pictures.paint([(100, 100), (300, 200)], [20.0, 30.0], rng, noise=4.0)
    found = background_of(picture)
    assert found.level == pytest.approx(10.0, abs=0.3)
    assert found.sigma == pytest.approx(4.0, rel=0.08)
    scaled = normalised(picture)
    assert (scaled.min(), scaled.max()) == (0.0, 1.0)
    assert not normalised(np.full((9, 9), 7, np.uint8)).any()


@pytest.mark.parametrize("rule", ["x", "own"])
def test_tips_of_antennas_are_the_ends_of_the_longest_outline(rng, rule):
    picture = pictures.paint([(400, 350)], [4.0], rng)
    ends = np.array([(150, 120), (460, 300)])
    cv2.line(picture, ends[0].tolist(), ends[1].tolist(), 200, 3)
    seen = look_for_spots(picture, SpotSettings(antennas=(0, 1), antenna_rule=rule))
    assert np.abs(seen.centres.pixels[:2] - ends).max() < 2.5
    assert len(seen.centres) == 3


def test_colours_name_markers_by_hue_and_by_clicks(rng):
    colours = ((0, 0, 230), (0, 220, 0), (230, 40, 0))  # red, green, blue
    picture = np.full((240, 320, 3), 12, np.uint8)
    places = [(60, 60), (160, 120), (250, 200)]
    for place, colour in zip(places, colours, strict=True):
        cv2.circle(picture, place, 8, colour, -1)
    picture = np.clip(picture + rng.normal(0, 3, picture.shape), 0, 255).astype(np.uint8)
    tests = tuple(train(picture[v - 2 : v + 3, u - 2 : u + 3].reshape(-1, 3)) for u, v in places)
    for named in ({"hues_deg": (0.0, 120.0, 230.0)}, {"colour_tests": tests}):
        seen = look_for_spots(picture, SpotSettings(colour_points=(4, 2, 0), **named))
        by_point = dict(zip(seen.centres.points.tolist(), seen.centres.pixels, strict=True))
        for point, place in zip((4, 2, 0), places, strict=True):
            assert by_point[point] == pytest.approx(place, abs=0.3)
    with pytest.raises(ValueError, match="not black"):
        train(np.zeros((4, 3), np.uint8))


def test_pictures_without_a_target_say_what_is_wrong(rng):
    dark = np.clip(rng.normal(3.0, 1.0, (480, 640)), 0, 255).astype(np.uint8)
    assert look_for_spots(dark, SpotSettings()).trouble is Trouble.DARK
    assert look_for_spots(np.zeros((480, 640), np.uint8), SpotSettings()).trouble is Trouble.DARK
    sun = pictures.paint([(320, 240)], [150.0], rng, level=400.0)
    assert look_for_spots(sun, SpotSettings()).trouble is Trouble.GLARE
    texture = (255 * (rng.random((480, 640)) > 0.8)).astype(np.uint8)
    assert look_for_spots(texture, SpotSettings()).trouble is not Trouble.NONE


def test_a_glare_is_masked_and_the_rest_is_seen(rng):
    picture = pictures.paint([(100, 100), (500, 300), (200, 400)], [3.0, 3.0, 3.0], rng)
    cv2.circle(picture, (420, 120), 40, 255, -1)
    seen = look_for_spots(picture, SpotSettings())
    assert seen.trouble is Trouble.NONE
    assert len(seen.centres) == 3
    assert 0.01 < seen.glare < 0.05


def test_a_tip_beside_another_is_not_drawn_to_it(rng):
    pixels = np.array([(100.3, 100.2), (104.9, 102.1)])
    off = []
    for _ in range(10):
        seen = look_for_spots(pictures.paint(pixels, [1.2, 1.2], rng), SpotSettings())
        gaps = seen.centres.pixels[None] - pixels[:, None]
        off.append(np.linalg.norm(gaps, axis=2).min(axis=1))
    assert np.mean(off) < 0.06
