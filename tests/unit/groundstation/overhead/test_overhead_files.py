"""Files of the camera over the table and of the circles: read back whole, refused in one sentence."""

import json
from pathlib import Path

import numpy as np
import pytest

from groundstation.files.errors import FileError
from groundstation.overhead.liveries import load_liveries
from groundstation.overhead.overhead_camera import OverheadCamera

FILES = Path(__file__).parents[4] / "calibration" / "rigs" / "emulated"
CAMERA = json.loads((FILES / "overhead_camera.json").read_text())
CIRCLES = (FILES / "circles.toml").read_text()


def test_a_camera_survives_its_file():
    camera = OverheadCamera.from_mapping(CAMERA)
    assert OverheadCamera.from_mapping(camera.to_mapping()) == camera
    rotation = camera.table_from_camera()
    assert np.allclose(rotation @ rotation.T, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_a_level_camera_has_the_tables_x_to_its_right_and_looks_down():
    level = OverheadCamera.from_mapping({**CAMERA, "yaw_rad": 0.0, "tilt_x_rad": 0.0, "tilt_y_rad": 0.0})
    assert np.array_equal(level.table_from_camera(), np.diag([1.0, -1.0, -1.0]))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"fx": None}, "'fx' must be a finite number"),
        ({"fx": -1}, "'fx' must be positive"),
        ({"width": 640.5}, "whole number"),
        ({"position_table_m": [0, 0]}, "'position_table_m' must be a list of 3"),
        ({"position_table_m": [0, 0, -2.0]}, "above the table"),
        ({"dist_k1_k2_p1_p2_k3": [0, 0, 0, 0, "x"]}, "5 finite numbers"),
        ({"tilt_x_rad": 3.0}, "away from the table"),
        ({"focal": 3.0}, "'focal' is no key"),
    ],
)
def test_a_wrong_camera_file_is_refused_by_its_key(tmp_path, change, sentence):
    path = tmp_path / "camera.json"
    path.write_text(json.dumps({**CAMERA, **change}))
    with pytest.raises(FileError, match=sentence) as caught:
        OverheadCamera.load(path)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("missing", sorted(CAMERA))
def test_a_missing_key_is_named(missing):
    rest = {key: value for key, value in CAMERA.items() if key != missing}
    with pytest.raises(ValueError, match=f"'{missing}' is missing"):
        OverheadCamera.from_mapping(rest)


@pytest.mark.parametrize("text", [None, "", "{", "[1]"])
def test_what_is_no_camera_file_is_refused(tmp_path, text):
    path = tmp_path / "camera.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(FileError):
        OverheadCamera.load(path)


def test_the_emulated_mock_ups_wear_three_circles_each():
    assert {livery.vehicle: len(livery.circles) for livery in load_liveries(FILES / "circles.toml")} == {
        "alpha": 3,
        "beta": 3,
    }


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('colour = "red"', 'colour = "pink"', r"alpha.circles.0: colour 'pink' is none of red, green, blue"),
        ("radius_m = 0.035", "radius = 0.035", "'alpha.radius' is no known key"),
        ("height_m = 0.30\n", "", "alpha.height_m is missing"),
        ("height_m = 0.30", "height_m = true", "alpha.height_m must be a finite number"),
        ("x_m = 0.14", 'x_m = "a"', "alpha.circles.0.x_m must be a finite number"),
        ('  { colour = "red", x_m = 0.14, y_m = 0.0 },\n', "", "three circles"),
        ("[beta]", "[alpha.beta]", "'alpha.beta' is no known key"),
        ('"blue", x_m = -0.04, y_m = 0.13', '"blue", x_m = -0.2, y_m = 0.0', None),
    ],
)
def test_wrong_circles_are_refused_by_their_key(tmp_path, old, new, sentence):
    path = tmp_path / "circles.toml"
    path.write_text(CIRCLES.replace(old, new, 1))
    if sentence is None:
        assert len(load_liveries(path)) == 2
        return
    with pytest.raises(FileError, match=sentence):
        load_liveries(path)


def test_mock_ups_that_look_the_same_from_above_are_refused(tmp_path):
    path = tmp_path / "circles.toml"
    alpha = CIRCLES[CIRCLES.index("[alpha]") : CIRCLES.index("[beta]")]
    path.write_text(alpha + alpha.replace("[alpha]", "[gamma]").replace("0.11", "0.115"))
    with pytest.raises(FileError, match="'alpha' and 'gamma' look the same from above"):
        load_liveries(path)
