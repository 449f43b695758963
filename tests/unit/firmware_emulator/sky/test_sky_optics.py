import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from firmware_emulator.sky.optics import CameraOptics

from .sky_scenes import OPTICS, opencv_pixels

CEILING = np.random.default_rng(5).uniform((-2.5, -2.0), (2.5, 2.0), (300, 2))
POSES = st.tuples(st.floats(-2.0, 2.0), st.floats(-1.5, 1.5), st.floats(-10.0, 10.0))


def inside(pixels):
    return np.all((pixels >= 0) & (pixels <= (639, 479)), axis=1)


@given(POSES)
def test_points_in_the_picture_lie_where_opencv_puts_them(pose):
    pixels, _ = OPTICS.project(CEILING, pose)
    expected = opencv_pixels(CEILING, pose)
    believed = np.all(np.isfinite(pixels), axis=1)
    np.testing.assert_allclose(pixels[believed], expected[believed], atol=1e-8)
    rays_m = np.linalg.norm(CEILING - pose[:2], axis=1)
    assert np.all(believed[inside(expected) & (rays_m < 1.6)])


def test_points_far_outside_the_view_never_fold_back_into_the_picture():
    bent_hard = CameraOptics(640, 480, (600.0, 600.0), (320.0, 240.0), (-0.3, 0.0, 0.0, 0.0, 0.0), 2.2)
    far = np.column_stack([np.linspace(3.0, 40.0, 200), np.zeros(200)])
    pixels, _ = bent_hard.project(far, (0.0, 0.0, 0.0))
    assert not np.any(inside(pixels))


def test_the_columns_of_the_mount_rotation_are_the_camera_axes():
    expected = Rotation.from_euler("ZXY", [OPTICS.yaw_rad, OPTICS.tilt_x_rad, OPTICS.tilt_y_rad])
    np.testing.assert_allclose(OPTICS.body_from_camera, expected.as_matrix(), atol=1e-15)


@given(POSES)
def test_a_ray_leads_back_to_the_point_it_came_from(pose):
    pixels = np.random.default_rng(2).uniform((0, 0), (639, 479), (50, 2))
    body_m, cosine = OPTICS.ceiling_in_body(pixels)
    c, s = np.cos(pose[2]), np.sin(pose[2])
    ceiling_m = body_m @ np.array([[c, s], [-s, c]]) + pose[:2]
    seen, seen_cosine = OPTICS.project(ceiling_m, pose)
    np.testing.assert_allclose(seen, pixels, atol=1e-6)
    np.testing.assert_allclose(seen_cosine, cosine, atol=1e-9)


@given(POSES)
def test_looking_up_pixels_to_ceiling_is_a_proper_similarity_turned_by_the_heading(pose):
    plain = CameraOptics(640, 480, (600.0, 600.0), (320.0, 240.0), (0.0,) * 5, 2.2)
    points = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.4], [-0.3, 0.2]]) + pose[:2]
    pixels, _ = plain.project(points, pose)
    z = (pixels - (320.0, 240.0)) @ [1.0, 1.0j]
    w = (points - pose[:2]) @ [1.0, 1.0j]
    turn = np.exp(1.0j * pose[2]) * 2.2 / 600.0
    np.testing.assert_allclose(w, turn * z, atol=1e-9)


def test_the_footprint_is_what_a_pinhole_sees():
    plain = CameraOptics(640, 480, (600.0, 600.0), (319.5, 239.5), (0.0,) * 5, 2.2)
    assert plain.footprint_m2() == pytest.approx(639 * 479 * (2.2 / 600.0) ** 2, rel=1e-9)


@pytest.mark.parametrize(
    ("height_m", "focal_px", "says"),
    [(0.0, 600.0, "positive"), (2.2, -1.0, "positive"), (np.nan, 1.0, "fini")],
)
def test_an_impossible_camera_is_refused(height_m, focal_px, says):
    with pytest.raises(ValueError, match=says):
        CameraOptics(640, 480, (focal_px, 600.0), (320.0, 240.0), (0.0,) * 5, height_m)
