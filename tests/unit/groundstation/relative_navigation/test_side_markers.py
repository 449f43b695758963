"""A mock-up found by its markers: accuracy, truth of the covariance, and what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.files.errors import FileError
from groundstation.relative_navigation.matching import Centres
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.planar_markers import MOST_PAIRS, find_by_markers, pairs_of
from groundstation.relative_navigation.side_bodies import SideBody, load_side_bodies
from groundstation.relative_navigation.side_looks import LOOKS
from groundstation.relative_navigation.sighting import Seen, Unseen

from .side_scenes import BODIES, CAMERA, Errors, Scene, pose_at

ALPHA = BODIES["alpha"]
POINTS = replace(ALPHA, marker_radius_m=1e-6)
"""The same with points of light, which have no nearer half."""


def look():
    return LOOKS["markers"](CAMERA, ALPHA)


def spots_of(pose, body=ALPHA, seen=None):
    """Pixels of the markers that face the camera, by the pinhole written out here."""
    x, y, heading = pose
    eye, yaw = np.array(CAMERA.position_body_m), CAMERA.yaw_rad
    found = []
    for azimuth, (px, py, pz) in zip(body.azimuths_rad, body.points_body_m(), strict=True):
        bx = x + math.cos(heading) * px - math.sin(heading) * py - eye[0]
        by = y + math.sin(heading) * px + math.cos(heading) * py - eye[1]
        if math.cos(azimuth + heading) * bx + math.sin(azimuth + heading) * by > -0.25 * math.hypot(bx, by):
            continue
        depth = math.cos(yaw) * bx + math.sin(yaw) * by
        across = math.sin(yaw) * bx - math.cos(yaw) * by
        lens = CAMERA.lens
        found.append(
            (lens.cx_px + lens.f_px * across / depth, lens.cy_px + lens.f_px * (eye[2] - pz) / depth)
        )
    return np.array(found if seen is None else found[:seen])


def centres(pixels, sigma_px=0.02):
    pixels = np.asarray(pixels, float).reshape(-1, 2)
    return Centres(pixels, np.broadcast_to(sigma_px**2 * np.eye(2), (len(pixels), 2, 2)).copy())


@pytest.mark.parametrize("range_m", [0.8, 1.5, 2.5])
def test_places_and_turns_are_as_drawn_and_the_covariance_is_true(range_m, rng):
    scene, errors, eye = Scene(), Errors(), look()
    for _ in range(40):
        pose = pose_at(range_m, rng.uniform(-0.12, 0.12), rng.uniform(-math.pi, math.pi))
        errors.add(eye(scene.picture(alpha=pose)), pose)
    assert not errors.unseen
    assert errors.rms("range_m") < 0.0002 + 0.0005 * (range_m / 1.5) ** 2
    assert errors.rms("bearing_rad") < math.radians(0.1)
    assert errors.rms("heading_rad") < math.radians(0.3)
    assert 0.3 < np.mean(errors.nes) < 2.0


def test_exact_pixels_give_the_exact_pose_and_noise_its_own_covariance(rng):
    pose = pose_at(1.5, 0.05, 0.7)
    exact = find_by_markers(CAMERA, POINTS, centres(spots_of(pose, POINTS)))
    assert isinstance(exact, Seen)
    assert (*exact.position_body_m, exact.heading_rad) == pytest.approx(pose, abs=1e-7)
    nes = []
    for _ in range(200):
        pixels = spots_of(pose, POINTS)
        seen = find_by_markers(CAMERA, POINTS, centres(pixels + rng.normal(0.0, 0.2, pixels.shape), 0.2))
        assert isinstance(seen, Seen)
        off = np.array([*seen.position_body_m, seen.heading_rad]) - pose
        nes.append(off @ np.linalg.solve(seen.covariance, off))
    assert np.mean(nes) / 3.0 == pytest.approx(
        0.9, abs=0.25
    )  # a misfit above 1 widens, one below does not narrow


def test_false_lights_are_left_out(rng):
    pose = pose_at(1.2, -0.05, 2.0)
    pixels = np.vstack([spots_of(pose, POINTS), rng.uniform((20, 20), (620, 460), (12, 2))])
    seen = find_by_markers(CAMERA, POINTS, centres(rng.permutation(pixels)))
    assert isinstance(seen, Seen)
    assert (*seen.position_body_m, seen.heading_rad) == pytest.approx(pose, abs=1e-3)


def test_lights_alone_are_no_body(rng):
    for _ in range(30):
        answer = find_by_markers(CAMERA, ALPHA, centres(rng.uniform((20, 20), (620, 460), (10, 2))))
        assert isinstance(answer, Unseen), answer


def test_too_few_and_too_many_spots_are_refused_with_their_number():
    pose = pose_at(1.5, 0.0, 0.3)
    few = find_by_markers(CAMERA, ALPHA, centres(spots_of(pose, seen=2)))
    assert isinstance(few, Unseen)
    assert few.reason.startswith("2 spots in the picture")
    many = find_by_markers(CAMERA, ALPHA, centres(np.zeros((50, 2))))
    assert isinstance(many, Unseen)
    assert "more than 40" in many.reason


def test_a_pattern_that_repeats_is_ambiguous_and_gives_no_pose():
    turns = tuple(math.radians(45.0 * step) for step in range(8))
    heights = (0.20, *(0.10, 0.30) * 3, 0.10)  # the one that differs is on the far side
    alike = SideBody("alike", 0.15, 0.06, 0.34, turns, heights, 0.01)
    answer = find_by_markers(CAMERA, alike, centres(spots_of(pose_at(1.5, 0.0, 0.2), alike)))
    assert isinstance(answer, Unseen)
    assert answer.is_ambiguous
    assert answer.reason == "two poses of alike explain the spots alike"


def test_the_work_in_one_picture_is_bounded():
    first, second = pairs_of(2560)  # 40 spots, 64 markers
    assert len(first) == len(second) <= MOST_PAIRS
    assert len(pairs_of(300)[0]) == 300 * 299 // 2


@pytest.mark.parametrize(
    ("markers", "said"),
    [
        ([(0.0, 0.3), (0.0, 0.1), (0.0, 0.2)], "all above each other"),
        ([(0.0, 0.3), (180.0, 0.1), (0.0, 0.2)], "one upright plane"),
        ([(0.0, 0.3), (20.0, 0.1)], "2 of them, expected 3"),
        ([(0.0, 0.3), (0.5, 0.3), (20.0, 0.1)], "less than 20 mm apart"),
        ([(0.0, 0.5), (40.0, 0.3), (20.0, 0.1)], "between bottom_m and top_m"),
        ([(5.625 * k, 0.3) for k in range(64)][::2], "they are the same pattern again"),
        ([(90.0 * k, z) for k in range(4) for z in (0.3, 0.1)], "turned by 90 deg they are the same pattern"),
    ],
)
def test_markers_that_give_no_pose_are_refused_when_the_file_is_read(tmp_path, markers, said):
    rows = ", ".join(f"{{ azimuth_deg = {azimuth}, z_m = {height} }}" for azimuth, height in markers)
    path = tmp_path / "bodies.toml"
    path.write_text(
        f"[a]\nradius_m = 0.15\nbottom_m = 0.06\ntop_m = 0.34\nmarker_radius_m = 0.01\nmarkers = [{rows}]\n"
    )
    with pytest.raises(FileError, match=said):
        load_side_bodies(path)


def test_sizes_of_nothing_are_refused():
    with pytest.raises(ValueError, match=r"a\.radius_m is 1e-300, expected at least 0\.005"):
        SideBody("a", 1e-300, 0.06, 0.34)
    with pytest.raises(ValueError, match="expected at most 50000000 pixels in all"):
        PinholeCamera(780.0, 318.0, 241.0, 100_000, 100_000)


def test_dark_pictures_and_the_lamp_in_view_give_a_sentence():
    eye = look()
    dark = eye(Scene(level_dn=0.0).picture())
    assert isinstance(dark, Unseen)
    assert "lights" in dark.reason or "dark" in dark.reason or "spots" in dark.reason
    for lamp_deg in (-15.0, 0.0, 5.0):
        answer = eye(Scene(lamp_deg).picture(alpha=pose_at(1.5, 0.0, 0.4)))
        if isinstance(answer, Seen):  # the body may still be told from the lamp: then it must be right
            assert answer.range_m == pytest.approx(1.5, abs=0.01)
        else:
            assert answer.reason


def test_a_body_without_markers_is_refused():
    with pytest.raises(ValueError, match="beta has no markers"):
        LOOKS["markers"](CAMERA, BODIES["beta"])
