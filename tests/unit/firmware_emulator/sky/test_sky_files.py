import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from drivers.files.errors import FileError
from firmware_emulator.sky.scene import build_sky, read_camera, read_ceiling
from firmware_emulator.sky.sky import Sky

ROOT = Path(__file__).parents[4]
RIG = ROOT / "calibration" / "rigs" / "emulated"


def distances(places):
    apart = np.linalg.norm(places[:, None] - places[None], axis=2)
    return apart[~np.eye(len(places), dtype=bool)]


def test_the_ceiling_of_the_rig_is_180_leds_apart_from_each_other():
    places = read_ceiling(RIG / "ceiling.csv")
    assert places.shape == (180, 2)
    assert np.all(np.abs(places) <= (2.5, 2.0))
    assert distances(places).min() > 0.149


def test_the_ceiling_of_the_rig_is_what_the_tool_makes(tmp_path):
    tool = ROOT / "tools" / "make_ceiling.py"
    out = tmp_path / "ceiling.csv"
    subprocess.run([sys.executable, tool, out, "--seed", "20"], check=True)
    assert out.read_bytes() == (RIG / "ceiling.csv").read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["ceiling.csv"]


def test_a_ceiling_too_full_is_said_in_one_sentence(tmp_path):
    tool = [sys.executable, ROOT / "tools" / "make_ceiling.py", tmp_path / "ceiling.csv"]
    done = subprocess.run(
        [*tool, "--count", "9", "--size-m", "0.2", "0.2"], check=False, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "LEDs fit into" in done.stderr
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_the_camera_of_the_rig_is_read_key_by_key():
    optics = read_camera(RIG / "camera.json")
    data = json.loads((RIG / "camera.json").read_text())
    assert (optics.width_px, optics.height_px) == (640, 480)
    assert optics.focal_px == (data["fx"], data["fy"])
    assert optics.centre_px == (data["cx"], data["cy"])
    assert list(optics.distortion) == data["dist_k1_k2_p1_p2_k3"]
    assert [*optics.offset_body_m, 0.0] == data["mount_offset_body_m"]
    assert optics.yaw_rad == data["mount_yaw_rad"]
    assert (optics.tilt_x_rad, optics.tilt_y_rad) == (data["mount_tilt_x_rad"], data["mount_tilt_y_rad"])
    assert optics.ceiling_height_m == data["ceiling_height_above_camera_m"]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty, expected the header id,x_m,y_m"),
        ("id,x_m\n0,1\n", "line 1, column 'y_m' is missing"),
        ("id,x_m,y_m\n", "has a header but no rows"),
        ("id,x_m,y_m\n0,1,2\n1,left,2\n", "line 3, x_m is 'left', expected a number"),
        ("id,x_m,y_m\n0,1\n", "line 2 has 2 columns, expected 3"),
        ("id,x_m,y_m\n0,nan,2\n", "line 2, x_m is 'nan', expected a number"),
    ],
)
def test_a_bad_star_list_is_named_with_its_place(tmp_path, text, says):
    path = tmp_path / "ceiling.csv"
    path.write_text(text)
    with pytest.raises(FileError, match=says) as caught:
        read_ceiling(path)
    assert str(path) in str(caught.value)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("fx", None),
        ("fx", "600"),
        ("cy", True),
        ("dist_k1_k2_p1_p2_k3", [0.0] * 4),
        ("mount_offset_body_m", 0.1),
        ("mount_yaw_rad", float("nan")),
    ],
)
def test_a_bad_camera_file_names_the_key(tmp_path, key, value):
    data = json.loads((RIG / "camera.json").read_text())
    data[key] = value
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(data))
    with pytest.raises(FileError, match=f"key '{key}' must be"):
        read_camera(path)


@pytest.mark.parametrize("text", ["", "{", "[1]", '{"fx": 1}'])
def test_a_file_that_is_no_camera_is_refused(tmp_path, text):
    path = tmp_path / "camera.json"
    path.write_text(text)
    with pytest.raises(FileError, match=str(path)):
        read_camera(path)


def test_missing_files_are_said(tmp_path):
    for read in (read_ceiling, read_camera):
        with pytest.raises(FileError, match="cannot be read"):
            read(tmp_path / "absent")


def test_a_camera_with_a_height_of_nothing_is_refused(tmp_path):
    data = json.loads((RIG / "camera.json").read_text())
    data["ceiling_height_above_camera_m"] = 0
    path = tmp_path / "camera.json"
    path.write_text(json.dumps(data))
    with pytest.raises(FileError, match="positive"):
        read_camera(path)


def test_a_sky_is_decided_by_its_seed():
    places = read_ceiling(RIG / "ceiling.csv")
    one, same, other = (build_sky(places, np.random.SeedSequence(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.brightness, same.brightness)
    assert one.glows == same.glows
    assert np.any(one.brightness != other.brightness)
    assert one.glows != other.glows


@pytest.mark.parametrize(
    ("places", "brightness"),
    [([], []), ([[0.0, 0.0]], [1.0, 1.0]), ([[0.0, np.nan]], [1.0]), ([[0.0, 0.0]], [-1.0])],
)
def test_an_impossible_sky_is_refused(places, brightness):
    with pytest.raises(ValueError, match=r"need|finite|darker"):
        Sky(places, brightness, np.random.default_rng(0))


def test_a_denser_crowd_of_stray_lights_keeps_the_places_of_a_thinner_one():
    sky = build_sky(read_ceiling(RIG / "ceiling.csv"), np.random.SeedSequence(1))
    thin, _ = sky.lights(0.5, is_dark=True)
    dense, _ = sky.lights(2.0, is_dark=True)
    np.testing.assert_array_equal(thin, dense[: len(thin)])
    assert 3.5 < len(dense) / len(thin) < 4.5
