"""The commands of the camera over the table: answers for pictures, and where it hangs from a board."""

import csv
import json
import tomllib
from pathlib import Path

import cv2
import numpy as np
import pytest

from firmware_emulator.overhead.scene import read_markings, read_overhead_camera
from firmware_emulator.overhead.table_view import Body, Light, TableView
from groundstation.cli.main import call
from groundstation.overhead.overhead_camera import OverheadCamera

FILES = Path(__file__).parents[4] / "calibration" / "rigs" / "emulated"
POSES = {"alpha": (-0.8, 0.1, 0.3), "beta": (0.9, 0.7, 2.0)}
BOARD_SQUARES, SQUARE_M, MARKER_M = (6, 4), 0.15, 0.11


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "frames").mkdir()
    (tmp_path / "camera.json").write_text((FILES / "overhead_camera.json").read_text())
    (tmp_path / "mock_ups.toml").write_text((FILES / "circles.toml").read_text())
    return tmp_path


@pytest.fixture(scope="module")
def picture():
    optics = read_overhead_camera(FILES / "overhead_camera.json")
    bodies = {name: Body(marks, 0.2) for name, marks in read_markings(FILES / "circles.toml").items()}
    view = TableView(optics, (-2.0, 2.0, -1.5, 1.5), bodies, Light(), np.random.SeedSequence(1))
    return view.render({name: (pose, pose) for name, pose in POSES.items()}, 0, {"beta": 1})


def board_picture(x_m, y_m, heading_deg):
    """A ChArUco board on the table as the emulator's optics see it, three times oversampled."""
    optics = read_overhead_camera(FILES / "overhead_camera.json")
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    board = cv2.aruco.CharucoBoard(BOARD_SQUARES, SQUARE_M, MARKER_M, dictionary)
    pitch_m = SQUARE_M / 100
    art = board.generateImage((100 * BOARD_SQUARES[0], 100 * BOARD_SQUARES[1]))
    fine, cell = 3, 4
    v, u = (np.indices((720 // cell, 960 // cell)).reshape(2, -1) + 0.5) * cell - 0.5
    coarse = optics.on_plane(np.column_stack([u, v]), 0.0)[0].reshape(720 // cell, 960 // cell, 2)
    place = cv2.resize(coarse, (960 * fine, 720 * fine), interpolation=cv2.INTER_LINEAR).reshape(-1, 2)
    c, s = np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg))
    dx, dy = place[:, 0] - x_m, place[:, 1] - y_m
    shape = (720 * fine, 960 * fine)
    column = ((c * dx + s * dy) / pitch_m - 0.5).reshape(shape).astype(np.float32)
    row = ((s * dx - c * dy) / pitch_m - 0.5).reshape(shape).astype(np.float32)
    seen = cv2.remap(art, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=200)
    return cv2.GaussianBlur(cv2.resize(seen, (960, 720), interpolation=cv2.INTER_AREA), (0, 0), 0.7)


def rows_of(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_every_mock_up_of_every_picture_gets_a_row(folder, picture):
    cv2.imwrite(str(folder / "frames" / "0007.png"), picture)
    assert call(["star-tracker", "overhead", str(folder), "--out", str(folder / "answers.csv")]) == 0
    alpha, beta = rows_of(folder / "answers.csv")
    assert (alpha["frame"], alpha["vehicle"], alpha["fix"], alpha["circles"]) == ("0007", "alpha", "1", "3")
    assert abs(float(alpha["x_m"]) - POSES["alpha"][0]) < 5 * float(alpha["std_x_m"]) < 0.005
    assert abs(float(alpha["heading_rad"]) - POSES["alpha"][2]) < 5 * float(alpha["std_heading_rad"])
    assert (beta["fix"], beta["x_m"]) == ("0", "")
    assert "circle" in beta["reason"]
    assert float(alpha["ms"]) == float(beta["ms"]) > 0


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (lambda f: (f / "mock_ups.toml").unlink(), "mock_ups.toml: cannot be read"),
        (lambda f: (f / "camera.json").write_text("{}"), "camera.json: key 'width' is missing"),
        (lambda f: cv2.imwrite(str(f / "frames" / "a.png"), np.zeros((720, 960), np.uint8)), "in colour"),
        (lambda f: cv2.imwrite(str(f / "frames" / "a.png"), np.zeros((48, 64, 3), np.uint8)), "64 x 48 px"),
        (lambda f: (f / "frames" / "a.png").write_bytes(b""), "is an empty file"),
        (lambda f: (f / "frames").rmdir(), "no such folder"),
    ],
)
def test_a_wrong_folder_is_refused_in_one_sentence(folder, capsys, spoil, sentence):
    spoil(folder)
    assert call(["star-tracker", "overhead", str(folder), "--out", str(folder / "answers.csv")]) == 2
    reported = capsys.readouterr().err
    assert sentence in reported
    assert reported.count("\n") == 1
    assert not (folder / "answers.csv").exists()


@pytest.mark.slow
def test_a_board_on_the_table_tells_where_the_camera_hangs(folder, capsys):
    truth = OverheadCamera.load(folder / "camera.json")
    lens = {k: v for k, v in truth.to_mapping().items() if k not in ("position_table_m", "tilt_x_rad")}
    (folder / "camera.json").write_text(json.dumps(lens))
    places = {"a": (-1.2, 0.9, 10.0), "b": (0.3, -0.2, -70.0)}
    off = {"a": (0.0015, -0.001, 0.1), "b": (-0.001, 0.002, -0.1)}  # what the tape was off
    lines = ["frame,x_m,y_m,heading_deg"]
    for name, place in places.items():
        cv2.imwrite(str(folder / "frames" / f"{name}.png"), board_picture(*place))
        lines.append(",".join([name, *(str(a + b) for a, b in zip(place, off[name], strict=True))]))
    (folder / "places.csv").write_text("\n".join(lines) + "\n")
    words = ["star-tracker", "overhead-pose", str(folder), "--out", str(folder / "pose.toml")]
    assert call([*words, "--camera-out", str(folder / "found.json"), "--plot", str(folder / "left.png")]) == 0
    assert cv2.imread(str(folder / "left.png")).shape[1] > 1000
    found = tomllib.loads((folder / "pose.toml").read_text())
    values = (*truth.position_table_m, truth.yaw_rad, truth.tilt_x_rad, truth.tilt_y_rad)
    for name, value in zip(("x_m", "y_m", "z_m", "yaw_rad", "tilt_x_rad", "tilt_y_rad"), values, strict=True):
        assert abs(found[name]["value"] - value) < 3 * found[name]["std"]
    assert max(found[name]["std"] for name in ("x_m", "y_m", "z_m")) < 0.008
    assert found["residual"]["corner_rms"]["value"] < 0.1
    assert OverheadCamera.load(folder / "found.json").position_table_m[2] == pytest.approx(2.6, abs=0.005)
    assert "hangs at" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("places", "sentence"),
    [
        ("frame,x_m,y_m\na,0,0\n", "line 1, column 'heading_deg' is missing"),
        ("frame,x_m,y_m,heading_deg\nz,0,0,0\n", "line 2, frame: there is no picture 'z'"),
        ("frame,x_m,y_m,heading_deg\na,0,?,0\n", "line 2, y_m is '?', expected a number"),
        ("frame,x_m,y_m,heading_deg\n", "places.csv: has a header but no rows"),
        ("frame,x_m,y_m,heading_deg\na,0,0,0\n", "no ChArUco board of 6x4 squares is found"),
    ],
)
def test_wrong_places_are_refused_in_one_sentence(folder, capsys, places, sentence):
    cv2.imwrite(str(folder / "frames" / "a.png"), np.full((720, 960, 3), 90, np.uint8))
    (folder / "places.csv").write_text(places)
    assert call(["star-tracker", "overhead-pose", str(folder), "--out", str(folder / "pose.toml")]) == 2
    reported = capsys.readouterr().err
    assert sentence in reported
    assert reported.count("\n") == 1
    assert not (folder / "pose.toml").exists()
