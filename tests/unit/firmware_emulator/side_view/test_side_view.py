"""What the emulated side camera draws: places by hand, hidden things, the lamp, what is wrong with it."""

import math
from pathlib import Path

import numpy as np
import pytest

from drivers.files.errors import FileError
from firmware_emulator.side_view.scene import Hull, Marker, SideOptics, read_hulls, read_side_camera
from firmware_emulator.side_view.side_view import SideView, SunLamp

FILES = Path(__file__).parents[4] / "calibration" / "rigs" / "emulated"
OPTICS = SideOptics(640, 480, 800.0, (320.0, 240.0), (0.1, 0.0, 0.2), 0.0)
PLAIN = Hull(0.15, 0.05, 0.35)
ONE = Hull(0.15, 0.05, 0.35, (Marker(math.pi, 0.30),), 0.01)
HERE = (0.0, 0.0, 0.0)
OFF = SunLamp(level_dn=0.0)


def picture(hulls, poses, lamp=OFF, own=HERE, **more):
    view = SideView(OPTICS, hulls, lamp, np.random.SeedSequence(3))
    drawn = view.render((own, own), {name: (pose, pose) for name, pose in poses.items()}, 1, **more)
    assert drawn.dtype == np.uint8
    assert drawn.shape == (480, 640)
    return drawn.astype(float)


def lit(drawn, least=60.0):
    """Rows and columns of patches, without hot pixels."""
    bright = drawn > least
    for axis in (0, 1):
        bright &= np.roll(bright, 1, axis) | np.roll(bright, -1, axis)
    return np.nonzero(bright)


def centre(drawn):
    rows, columns = lit(drawn)
    return columns.mean(), rows.mean()


def test_a_marker_is_where_the_similar_triangles_put_it():
    """The marker faces the camera 1 m before it, 0.1 m above its height: 80 px up."""
    assert centre(picture({"a": ONE}, {"a": (1.25, 0.0, 0.0)})) == pytest.approx((320.0, 160.0), abs=0.15)
    sideways = picture({"a": ONE}, {"a": (1.25, 0.2, 0.0)})
    assert centre(sideways) == pytest.approx((320.0 - 160.0, 160.0), abs=0.4)  # to the left, seen a bit askew


def test_turning_the_carrier_moves_the_picture_and_turning_the_body_hides_the_marker():
    turned = picture({"a": ONE}, {"a": (1.25, 0.0, 0.0)}, own=(0.0, 0.0, 0.1))
    assert centre(turned)[0] > 390.0  # the carrier looks to the left of it
    assert len(lit(picture({"a": ONE}, {"a": (1.25, 0.0, math.pi)}))[0]) == 0
    assert len(lit(picture({"a": ONE}, {"a": (-1.25, 0.0, math.pi)}))[0]) == 0  # behind the camera


def test_a_nearer_body_hides_a_farther_one():
    hulls, far = {"a": ONE, "b": PLAIN}, (1.85, 0.0, 0.0)
    assert len(lit(picture(hulls, {"a": far, "b": (1.0, 0.6, 0.0)}))[0]) > 20
    assert len(lit(picture(hulls, {"a": far, "b": (1.0, 0.0, 0.0)}))[0]) == 0


def test_only_the_side_towards_the_lamp_is_lit_and_heights_are_those_of_the_hull():
    lamp = SunLamp(math.radians(90.0), 0.0, 200.0)  # from the left
    drawn = picture({"a": PLAIN}, {"a": (1.25, 0.0, 0.0)}, lamp)
    rows, columns = lit(drawn, 20.0)
    half_px = 800.0 * math.tan(math.asin(0.15 / 1.15))
    assert columns.min() == pytest.approx(320.0 - half_px, abs=1.5)
    assert columns.max() < 320.0
    assert (rows.min(), rows.max()) == pytest.approx((240.0 - 0.15 * 800.0, 240.0 + 0.15 * 800.0), abs=3.0)
    whole = picture({"a": PLAIN}, {"a": (1.25, 0.0, 0.0)}, SunLamp(math.radians(90.0), 0.0, 200.0, 0.5))
    assert lit(whole, 20.0)[1].max() == pytest.approx(320.0 + half_px, abs=1.5)


def test_the_lamp_itself_is_seen_where_the_camera_looks_at_it():
    away, into = (picture({}, {}, SunLamp(math.radians(angle), 0.1, 200.0)) for angle in (90.0, 5.0))
    assert np.count_nonzero(away >= 250.0) == 0
    assert np.count_nonzero(into >= 250.0) > 600


def test_a_dark_view_and_a_covered_lens_show_no_marker():
    poses = {"a": (1.25, 0.0, 0.0)}
    assert len(lit(picture({"a": ONE}, poses, is_dark=True))[0]) == 0
    assert len(lit(picture({"a": ONE}, poses, covered_share=1.0))[0]) == 0
    assert len(lit(picture({"a": ONE}, poses, covered_share=0.3))[0]) > 20


def test_motion_during_the_exposure_blurs():
    view = SideView(OPTICS, {"a": ONE}, OFF, np.random.SeedSequence(3))
    paths = {"a": ((1.25, -0.01, 0.0), (1.25, 0.01, 0.0))}
    wide = np.ptp(lit(view.render((HERE, HERE), paths, 1).astype(float), 30.0)[1])
    still = np.ptp(lit(picture({"a": ONE}, {"a": (1.25, 0.0, 0.0)}), 30.0)[1])
    assert wide >= still + 5


def test_the_noise_of_a_frame_is_its_own_and_the_same_again():
    view = SideView(OPTICS, {}, OFF, np.random.SeedSequence(3))
    first, again, other = (view.render((HERE, HERE), {}, number) for number in (1, 1, 2))
    assert (first == again).all()
    assert (first != other).mean() > 0.3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('{"width": 640}', "position_body_m"),
        ('{"width": 640, "height": 480, "f_px": -1, "cx": 1, "cy": 1, "position_body_m": [0, 0, 1], '
         '"yaw_rad": 0}', "must be positive"),
    ],
)  # fmt: skip
def test_a_wrong_camera_file_is_named(tmp_path, text, said):
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(FileError, match=said):
        read_side_camera(path)


WRONG_HULLS = (
    "[a]\nradius_m = 0.1\n",
    "[a]\nradius_m = 0.1\nbottom_m = 0.3\ntop_m = 0.2\n",
    '[a]\nradius_m = "x"\nbottom_m = 0.1\ntop_m = 0.2\n',
)


@pytest.mark.parametrize("text", WRONG_HULLS)
def test_a_wrong_file_of_hulls_is_named(tmp_path, text):
    path = tmp_path / "bodies.toml"
    path.write_text(text)
    with pytest.raises(FileError, match=r"bodies\.toml"):
        read_hulls(path)


def test_the_files_of_the_example_are_read():
    assert read_side_camera(FILES / "side_camera.json").width_px == 640
    hulls = read_hulls(FILES / "side_bodies.toml")
    assert len(hulls["alpha"].markers) == 14
    assert not hulls["beta"].markers
