"""A plain mock-up found by its lit part: accuracy for lamps all around, truth of the covariance, refusals."""

import math

import numpy as np
import pytest

from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.side_looks import LOOKS
from groundstation.relative_navigation.sighting import Seen, Unseen

from .side_scenes import BODIES, CAMERA, Errors, Scene, pose_at

GAMMA = BODIES["gamma"]


def look(body=GAMMA):
    return LOOKS["lit_part"](CAMERA, body)


@pytest.mark.parametrize("ambient", [0.0, 0.2])
def test_places_are_as_drawn_for_lamps_from_behind_to_nearly_in_view(ambient, rng):
    errors, eye = Errors(), look()
    for lamp_deg in np.linspace(-140.0, 140.0, 15):
        scene = Scene(180.0 + lamp_deg, ambient=ambient)  # 0: from behind the camera
        for _ in range(2):
            pose = pose_at(1.5, rng.uniform(-0.1, 0.1), rng.uniform(-3.0, 3.0))
            errors.add(eye(scene.picture(gamma=pose)), pose)
    assert len(errors.unseen) <= 2, errors.unseen
    assert errors.rms("range_m") < 0.005
    assert errors.rms("bearing_rad") < math.radians(0.5)
    assert 0.05 < np.mean(errors.nes) < 3.0


def test_a_near_body_that_fills_the_picture_is_found():
    pose = pose_at(0.8, 0.0, 0.0)
    seen = look()(Scene(180.0).picture(gamma=pose))
    assert isinstance(seen, Seen)
    assert seen.range_m == pytest.approx(0.8, abs=0.002)


def test_how_it_is_turned_cannot_be_seen_and_is_said_so():
    seen = look()(Scene(100.0).picture(gamma=pose_at(1.2, 0.05, 1.0)))
    assert isinstance(seen, Seen)
    assert math.isnan(seen.heading_rad)
    assert seen.covariance[2, 2] == math.inf
    assert (seen.covariance[2, :2] == 0.0).all()
    assert np.isfinite(seen.covariance[:2, :2]).all()


@pytest.mark.parametrize(
    ("scene", "poses", "reason"),
    [
        (Scene(100.0), {}, "nothing is lit"),
        (Scene(0.0, level_dn=0.0), {"gamma": pose_at(1.5, 0.0, 0.0)}, "nothing is lit"),
        (Scene(5.0), {}, "over-exposed"),
        (Scene(180.0), {"gamma": pose_at(0.65, 0.0, 0.0)}, "edge of the body is out of view"),
        (Scene(180.0), {"gamma": pose_at(1.0, 0.42, 0.0)}, "cuts the lit part"),
        (Scene(180.0), {"gamma": pose_at(1.5, 0.15, 0.0), "beta": pose_at(1.5, -0.15, 0.0)}, "more than one"),
    ],
)
def test_what_cannot_be_measured_is_refused_with_its_reason(scene, poses, reason):
    answer = look()(scene.picture(**poses))
    assert isinstance(answer, Unseen)
    assert reason in answer.reason
    assert answer.is_ambiguous == (reason == "more than one")


def test_another_shape_than_the_files_is_refused():
    other = SideBody("gamma", 0.08, 0.06, 0.34)
    answer = look(other)(Scene(180.0).picture(gamma=pose_at(1.2, 0.0, 0.0)))
    assert isinstance(answer, Unseen)
    assert "is none of gamma" in answer.reason


def test_a_camera_above_the_body_is_refused():
    with pytest.raises(ValueError, match=r"the camera is 0\.2 m high, expected between"):
        look(SideBody("flat", 0.15, 0.02, 0.15))


def hidden(picture, pose, rng):
    """A dark edge of a random direction before the lens, somewhere over the body."""
    right_px = 318.4 - 780.0 * pose[1] / pose[0]
    half_px = 780.0 * 0.15 / (pose[0] - 0.15)
    angle = rng.choice((0.0, 0.5, 1.0, 1.5)) * math.pi if rng.random() < 0.8 else rng.uniform(-3.1, 3.1)
    rows, columns = np.mgrid[: picture.shape[0], : picture.shape[1]]
    beyond = (columns - right_px - rng.uniform(-1.0, 1.0) * half_px) * math.cos(angle)
    beyond += (rows - 240.0 - rng.uniform(-100.0, 100.0)) * math.sin(angle)
    shown = np.clip(0.5 - beyond / rng.choice((1.0, 8.0, 40.0)), 0.0, 1.0)
    noise = rng.normal(2.0, 1.0, picture.shape)
    return np.clip(picture * shown + noise * (1.0 - shown), 0, 255).round().astype(np.uint8)


def sigmas_off(seen, pose):
    off = seen.position_body_m - pose[:2]
    return math.sqrt(off @ np.linalg.solve(seen.covariance[:2, :2], off))


@pytest.mark.parametrize("lamp_deg", [-120.0, -60.0, 0.0, 60.0, 120.0])
def test_a_body_that_something_hides_in_part_is_refused_or_right(lamp_deg, rng):
    eye, seen, scene = look(), [], Scene(180.0 + lamp_deg)
    for _ in range(16):
        pose = pose_at(rng.uniform(0.9, 2.0), rng.uniform(-0.1, 0.1), 0.3)
        answer = eye(hidden(scene.picture(gamma=pose), pose, rng))
        if isinstance(answer, Seen):
            seen.append(sigmas_off(answer, pose))
    assert all(off < 5.0 for off in seen), seen


def test_a_cut_in_the_dim_part_is_noticed():
    """The mean square of the residuals is 0.4: an edge near the terminator hides little and moves much."""
    eye, scene, pose = look(), Scene(180.0 + 60.0), pose_at(1.2, 0.0, 0.3)
    whole = scene.picture(gamma=pose)
    assert isinstance(eye(whole), Seen)
    lit = np.flatnonzero(whole[240] > 20)
    for share in (0.75, 0.8, 0.85):  # from the limb on the lamp's side towards the terminator
        for columns in (lit, lit[::-1]):
            cut = whole.copy()
            edge = columns[round(share * len(columns))]
            cut[:, slice(edge, None) if columns is lit else slice(None, edge)] = 2
            answer = eye(cut)
            assert isinstance(answer, Unseen) or sigmas_off(answer, pose) < 5.0


def test_hot_pixels_at_an_edge_spoil_no_sighting(rng):
    eye, scene = look(), Scene(150.0)
    for _ in range(6):
        pose = pose_at(1.3, rng.uniform(-0.1, 0.1), 0.0)
        picture = scene.picture(gamma=pose)
        lit = np.flatnonzero(picture[240] > 60)
        picture[[160, 165], rng.choice(lit, 2)] = 200
        answer = eye(picture)
        assert isinstance(answer, Seen)
        assert answer.misfit < 2.0
        assert sigmas_off(answer, pose) < 5.0
