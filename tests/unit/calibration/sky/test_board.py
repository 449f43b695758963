"""Lens calibration from painted boards."""

import cv2
import numpy as np
import pytest

from calibration.sky.board import Board, calibrate_from_board, find_corners

MATRIX = np.array([[600.0, 0.0, 321.0], [0.0, 601.0, 238.0], [0.0, 0.0, 1.0]])


def paint(board, turn, shift):
    """A board seen through a pinhole: warped by its homography, twice oversampled."""
    scale = 2
    h = MATRIX @ np.column_stack((cv2.Rodrigues(np.asarray(turn))[0][:, :2], shift))
    square = 40
    if board.marker_m:
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
        charuco = cv2.aruco.CharucoBoard(
            (board.columns, board.rows), board.square_m, board.marker_m, dictionary
        )
        sheet = charuco.generateImage((board.columns * square, board.rows * square))
    else:
        dark = np.add.outer(np.arange(board.rows), np.arange(board.columns)) % 2 == 0
        sheet = np.kron(np.where(dark, 20, 235), np.ones((square, square))).astype(np.uint8)
    to_board = np.diag([board.square_m / square, board.square_m / square, 1.0])
    to_board[:2, 2] = 0.5 * board.square_m / square
    upscale = np.array([[scale, 0, (scale - 1) / 2], [0, scale, (scale - 1) / 2], [0, 0, 1.0]])
    big = cv2.warpPerspective(sheet, upscale @ h @ to_board, (1280, 960), borderValue=235)
    return cv2.resize(big, (640, 480), interpolation=cv2.INTER_AREA)


def views(board, count):
    rng = np.random.default_rng(3)
    found = []
    for _ in range(count):
        turn = rng.uniform(-0.5, 0.5, 3)
        centre = np.array([board.columns, board.rows, 0]) * board.square_m / 2
        shift = np.array([*rng.uniform(-0.05, 0.05, 2), 0.6]) - cv2.Rodrigues(turn)[0] @ centre
        view = find_corners(paint(board, turn, shift), board)
        if view is not None:
            found.append(view)
    return found


@pytest.mark.parametrize("marker_m", [0.0, 0.022])
def test_the_lens_of_a_painted_board_is_found(marker_m):
    board = Board(9, 6, 0.03, marker_m)
    seen = views(board, 12)
    assert len(seen) >= 8
    lens = calibrate_from_board(seen, 640, 480)
    assert lens.fx == pytest.approx(600.0, rel=0.01)
    assert lens.fy == pytest.approx(601.0, rel=0.01)
    assert np.sqrt((lens.residual_px**2).mean()) < 0.15


def test_too_few_views_and_impossible_boards_are_refused():
    with pytest.raises(ValueError, match="5 are needed"):
        calibrate_from_board([], 640, 480)
    with pytest.raises(ValueError, match="4 x 4"):
        Board(3, 6, 0.03)
    with pytest.raises(ValueError, match="smaller"):
        Board(9, 6, 0.03, 0.04)
    assert find_corners(np.full((480, 640), 128, np.uint8), Board(9, 6, 0.03)) is None
