"""Camera and catalogue files: what is wrong is said in one sentence."""

import json

import numpy as np
import pytest

from groundstation.files.errors import FileError
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.star_catalogue import StarCatalogue

GOOD = {
    "width": 640,
    "height": 480,
    "fx": 602.5,
    "fy": 601.2,
    "cx": 322.7,
    "cy": 236.4,
    "dist_k1_k2_p1_p2_k3": [-0.105, 0.062, 0.0009, -0.0012, 0.0],
    "ceiling_height_above_camera_m": 2.2,
    "mount_offset_body_m": [0.031, -0.018, 0.0],
    "mount_yaw_rad": 0.035,
    "mount_tilt_x_rad": 0.0052,
    "mount_tilt_y_rad": -0.0035,
}


def write(path, data):
    path.write_text(json.dumps(data))
    return path


def test_a_camera_survives_the_way_to_its_file_and_back(tmp_path):
    camera = CameraCalibration.load(write(tmp_path / "camera.json", GOOD))
    assert camera.to_mapping() == GOOD
    assert np.allclose(camera.body_from_camera() @ camera.body_from_camera().T, np.eye(3))


@pytest.mark.parametrize("key", sorted(GOOD))
def test_a_missing_key_is_named(tmp_path, key):
    data = {k: v for k, v in GOOD.items() if k != key}
    with pytest.raises(FileError, match=f"'{key}' is missing"):
        CameraCalibration.load(write(tmp_path / "camera.json", data))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("fx", -1.0),
        ("fy", "wide"),
        ("width", 640.5),
        ("cx", float("nan")),
        ("dist_k1_k2_p1_p2_k3", [0.1]),
        ("mount_offset_body_m", 3),
        ("ceiling_height_above_camera_m", 0.0),
        ("mount_tilt_x_rad", 12.0),
        ("fx", True),
    ],
)
def test_an_impossible_value_is_named_with_its_key(tmp_path, key, value):
    with pytest.raises(FileError, match=key):
        CameraCalibration.load(write(tmp_path / "camera.json", {**GOOD, key: value}))


@pytest.mark.parametrize("text", ["", "[1, 2]", "{", "\x00"])
def test_what_is_no_json_object_is_refused(tmp_path, text):
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(FileError, match=r"camera\.json"):
        CameraCalibration.load(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(FileError, match="cannot be read"):
        CameraCalibration.load(tmp_path / "camera.json")
    with pytest.raises(FileError, match="cannot be read"):
        StarCatalogue.load(tmp_path / "ceiling.csv")


ROWS = "id,x_m,y_m\n0,1.0,1.0\n1,2.0,1.0\n2,1.0,2.0\n3,2.0,2.5\n"


def test_a_catalogue_keeps_ids_and_positions(tmp_path):
    path = tmp_path / "ceiling.csv"
    path.write_text(ROWS)
    catalogue = StarCatalogue.load(path)
    assert catalogue.ids == ("0", "1", "2", "3")
    assert catalogue.y_m[3] == 2.5
    assert not catalogue.sigma_m.any()


def test_a_surveyed_catalogue_brings_its_standard_deviations(tmp_path):
    path = tmp_path / "ceiling.csv"
    lines = ROWS.splitlines()
    path.write_text("\n".join([lines[0] + ",std_x_m,std_y_m", *(line + ",3e-4,4e-4" for line in lines[1:])]))
    assert np.allclose(StarCatalogue.load(path).sigma_m, np.sqrt(12.5) * 1e-4)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("id,x_m\n0,1\n", "column 'y_m'"),
        (ROWS + "3,4.0,4.0\n", "'3' appears twice"),
        (ROWS + "4,2.0002,2.5001\n", "one place"),
        (ROWS + "4,nan,1.0\n", "line 6, x_m"),
        (ROWS + "4,1.5,north\n", "line 6, y_m"),
        (ROWS + "4,1.5\n", "line 6 has 2 columns"),
        ("id,x_m,y_m\n0,1.0,1.0\n1,2.0,1.0\n2,1.0,2.0\n", "at least 4 stars"),
    ],
)
def test_a_wrong_catalogue_is_refused_in_one_sentence(tmp_path, text, words):
    path = tmp_path / "ceiling.csv"
    path.write_text(text)
    with pytest.raises(FileError, match=words) as refusal:
        StarCatalogue.load(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(("stars", "is_refused"), [(5000, False), (5001, True), (60_000, True)])
def test_a_list_of_more_stars_than_can_be_looked_up_is_refused_at_once(tmp_path, stars, is_refused):
    path = tmp_path / "ceiling.csv"
    side = 300
    lines = [f"{row},{0.04 * (row % side):.3f},{0.04 * (row // side):.3f}" for row in range(stars)]
    path.write_text("id,x_m,y_m\n" + "\n".join(lines) + "\n")
    if not is_refused:
        assert len(StarCatalogue.load(path)) == stars
        return
    with pytest.raises(FileError, match=rf"ceiling\.csv: lists {stars} stars, expected 5000 at most"):
        StarCatalogue.load(path)
