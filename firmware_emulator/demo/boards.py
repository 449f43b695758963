"""Demo data of cameras that see boards and mock-ups: a chessboard, the table from above, a board on it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_emulator.demo.writing import overhead_camera_keys, write_frame, write_json, write_table
from firmware_emulator.overhead.optics import OverheadOptics
from firmware_emulator.overhead.scene import Disc, Markings
from firmware_emulator.overhead.table_view import Body, Light, TableView

ABOVE = OverheadOptics(
    width_px=960,
    height_px=720,
    focal_px=(471.2, 472.0),
    centre_px=(476.4, 362.1),
    distortion=(-0.055, 0.009, 0.0006, -0.0004, 0.0),
    position_m=(0.03, -0.02, 2.6),
    yaw_rad=0.015,
    tilt_x_rad=0.011,
    tilt_y_rad=-0.008,
)
BOUNDS_M = (-2.0, 2.0, -1.5, 1.5)
_NOSE = Disc("red", 0.14, 0.0)
MARKINGS = {
    "alpha": Markings(0.30, 0.035, (_NOSE, Disc("green", -0.09, 0.11), Disc("blue", -0.09, -0.11))),
    "beta": Markings(0.30, 0.035, (_NOSE, Disc("blue", -0.04, 0.13), Disc("green", -0.11, -0.09))),
}
RADIUS_M = 0.2
_SQUARE_PX = 100  # of the drawn boards
_FINE = 3  # times finer than pixels, then averaged
_LENS_PX = np.array([[600.0, 0.0, 321.0], [0.0, 601.0, 238.0], [0.0, 0.0, 1.0]])
_CHESS_M, _CHESS = 0.03, (9, 6)
_CHARUCO_M, _MARKER_M, _CHARUCO = 0.15, 0.11, (6, 4)
TAPE_SIGMA_M, TAPE_SIGMA_DEG = 1e-3, 0.1


def chessboard(folder: Path, seed: int) -> None:
    """Fourteen views of a board of 9 x 6 squares of 30 mm, at many angles all over the picture."""
    rng = np.random.default_rng([seed, 5])
    columns, rows = _CHESS
    dark = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0
    sheet = np.kron(np.where(dark, 20, 235), np.ones((_SQUARE_PX, _SQUARE_PX))).astype(np.uint8)
    middle = np.array([columns, rows, 0]) * 0.5 * _CHESS_M
    for number in range(14):
        turn = np.asarray(cv2.Rodrigues(rng.uniform(-0.45, 0.45, 3))[0], dtype=np.float64)
        shift = np.array([*rng.uniform(-0.06, 0.06, 2), rng.uniform(0.5, 0.65)]) - turn @ middle
        write_frame(folder, number, _seen_flat(sheet, turn, shift))
    write_json(folder / "lens_truth.json", {"fx": 600.0, "fy": 601.0, "cx": 321.0, "cy": 238.0})


def from_above(folder: Path, seed: int) -> None:
    """Six pictures of two mock-ups."""
    rng = np.random.default_rng([seed, 6])
    bodies = {name: Body(markings, RADIUS_M) for name, markings in MARKINGS.items()}
    view = TableView(ABOVE, BOUNDS_M, bodies, Light(), np.random.SeedSequence([seed, 7]))
    rows = []
    for number in range(6):
        poses = {
            name: (float(rng.uniform(*side)), float(rng.uniform(-1.0, 1.0)), float(rng.uniform(-3.0, 3.0)))
            for name, side in (("alpha", (-1.4, -0.4)), ("beta", (0.4, 1.4)))
        }
        frame = write_frame(folder, number, view.render({n: (p, p) for n, p in poses.items()}, number))
        rows += [(frame, name, *(f"{value:.6f}" for value in pose)) for name, pose in poses.items()]
    write_json(folder / "camera.json", overhead_camera_keys(ABOVE))
    (folder / "mock_ups.toml").write_text(_liveries(), encoding="utf-8")
    write_table(folder / "truth.csv", "frame,vehicle,x_m,y_m,heading_rad", rows)


def on_table(folder: Path, seed: int) -> None:
    """A ChArUco board of 6 x 4 squares of 150 mm at three places; the camera's pose is a guess."""
    rng = np.random.default_rng([seed, 8])
    rows = []
    for number, place in enumerate(((-1.2, 0.9, 10.0), (0.3, -0.2, -70.0), (0.1, 1.1, -15.0))):
        frame = write_frame(folder, number, _seen_on_table(place))
        x_m, y_m = place[:2] + TAPE_SIGMA_M * rng.standard_normal(2)
        heading_deg = place[2] + TAPE_SIGMA_DEG * rng.standard_normal()
        rows.append((frame, f"{x_m:.4f}", f"{y_m:.4f}", f"{heading_deg:.2f}"))
    write_table(folder / "places.csv", "frame,x_m,y_m,heading_deg", rows)
    guess = replace(ABOVE, position_m=(0.0, 0.0, 2.5), yaw_rad=0.0, tilt_x_rad=0.0, tilt_y_rad=0.0)
    write_json(folder / "camera.json", overhead_camera_keys(guess))
    write_json(folder / "camera_truth.json", overhead_camera_keys(ABOVE))


def _seen_flat(
    sheet: NDArray[np.uint8], turn: NDArray[np.float64], shift: NDArray[np.float64]
) -> NDArray[np.uint8]:
    """A flat sheet through a pinhole: its homography, finer than the pixels."""
    pitch = _CHESS_M / _SQUARE_PX
    to_board = np.array([[pitch, 0.0, 0.5 * pitch], [0.0, pitch, 0.5 * pitch], [0.0, 0.0, 1.0]])
    half = 0.5 * (_FINE - 1)
    finer = np.array([[_FINE, 0.0, half], [0.0, _FINE, half], [0.0, 0.0, 1.0]])
    homography = finer @ _LENS_PX @ np.column_stack((turn[:, :2], shift)) @ to_board
    big = cv2.warpPerspective(sheet, homography, (640 * _FINE, 480 * _FINE), borderValue=235)
    return np.asarray(cv2.resize(big, (640, 480), interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _seen_on_table(place: Sequence[float]) -> NDArray[np.uint8]:
    """The board on the table by the emulator's own optics."""
    x_m, y_m, heading_deg = place
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    board = cv2.aruco.CharucoBoard(_CHARUCO, _CHARUCO_M, _MARKER_M, dictionary)
    art = board.generateImage((_SQUARE_PX * _CHARUCO[0], _SQUARE_PX * _CHARUCO[1]))
    size, cell = (ABOVE.width_px, ABOVE.height_px), 4
    v, u = (np.indices((size[1] // cell, size[0] // cell)).reshape(2, -1) + 0.5) * cell - 0.5
    coarse = ABOVE.on_plane(np.column_stack([u, v]), 0.0)[0].reshape(size[1] // cell, size[0] // cell, 2)
    shape = (size[1] * _FINE, size[0] * _FINE)
    seen_m = cv2.resize(coarse, shape[::-1], interpolation=cv2.INTER_LINEAR)
    c, s = np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg))
    dx, dy = seen_m[..., 0] - x_m, seen_m[..., 1] - y_m
    pitch_m = _CHARUCO_M / _SQUARE_PX
    column = ((c * dx + s * dy) / pitch_m - 0.5).astype(np.float32)
    row = ((s * dx - c * dy) / pitch_m - 0.5).astype(np.float32)
    big = cv2.remap(art, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=(200.0,))
    picture = cv2.resize(big, size, interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.GaussianBlur(picture, (0, 0), 0.7), dtype=np.uint8)


def _liveries() -> str:
    lines = []
    for name, marks in MARKINGS.items():
        lines += [f"[{name}]", f"height_m = {marks.height_m}", f"radius_m = {marks.radius_m}", "circles = ["]
        lines += [f'  {{ colour = "{d.colour}", x_m = {d.x_m}, y_m = {d.y_m} }},' for d in marks.discs]
        lines += ["]", ""]
    return "\n".join(lines)
