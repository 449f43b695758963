"""Camera intrinsics from pictures of a chessboard or a ChArUco board (Zhang's method, by OpenCV)."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError

MIN_PICTURES = 5
MOST_SQUARES = 100
LEAST_MARKER_M = 1e-4
_CORNER_WINDOW = (7, 7)


@dataclass(frozen=True, slots=True)
class Board:
    """A printed board.

    Attributes:
        columns: Squares along the long side.
        rows: Squares along the short side.
        square_m: Edge of a square.
        marker_m: Edge of a ChArUco marker (dictionary 4x4, 250); 0 for a plain chessboard.
    """

    columns: int
    rows: int
    square_m: float
    marker_m: float = 0.0

    def __post_init__(self) -> None:
        if self.columns < 4 or self.rows < 4:
            raise ValueError("a board needs at least 4 x 4 squares")
        if self.columns > MOST_SQUARES or self.rows > MOST_SQUARES:
            raise ValueError(f"a board has at most {MOST_SQUARES} x {MOST_SQUARES} squares")
        if not 0.0 <= self.marker_m < self.square_m:
            raise ValueError("the markers must be smaller than the squares")
        if 0.0 < self.marker_m < LEAST_MARKER_M:
            raise ValueError(f"the markers must be at least {1e3 * LEAST_MARKER_M:g} mm, or 0 for none")


@dataclass(frozen=True, slots=True, eq=False)
class Intrinsics:
    """Result of a board calibration.

    Attributes:
        fx: Focal length, px.
        fy: Focal length, px.
        cx: Principal point, px.
        cy: Principal point, px.
        distortion: k1, k2, p1, p2, k3.
        sigma: One sigma of fx, fy, cx, cy, k1, k2, p1, p2, k3.
        residual_px: Corner minus model, shape (m, 2).
        pictures: How many showed the board.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float]
    sigma: tuple[float, ...]
    residual_px: NDArray[np.float64]
    pictures: int


def find_corners(
    image: NDArray[np.uint8], board: Board
) -> tuple[NDArray[np.float32], NDArray[np.float32]] | None:
    """Find the inner corners of a board: (board points (n, 3) in m, pixels (n, 2)), None if not seen."""
    if board.marker_m > 0.0:
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
        charuco = cv2.aruco.CharucoBoard(
            (board.columns, board.rows), board.square_m, board.marker_m, dictionary
        )
        pixel, number, _, _ = cv2.aruco.CharucoDetector(charuco).detectBoard(image)
        if number is None or len(number) < 6:
            return None
        points = np.asarray(charuco.getChessboardCorners(), dtype=np.float32)
        return points[np.asarray(number).ravel()], np.asarray(pixel, dtype=np.float32).reshape(-1, 2)
    size = (board.columns - 1, board.rows - 1)
    found, corners = cv2.findChessboardCorners(image, size)
    if not found:
        return None
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-4)
    corners = cv2.cornerSubPix(image, corners, _CORNER_WINDOW, (-1, -1), criteria)
    grid = np.zeros((size[0] * size[1], 3), np.float32)
    grid[:, :2] = np.mgrid[: size[0], : size[1]].T.reshape(-1, 2) * board.square_m
    return grid, np.asarray(corners, dtype=np.float32).reshape(-1, 2)


def calibrate_from_board(
    views: Sequence[tuple[NDArray[np.float32], NDArray[np.float32]]], width: int, height: int
) -> Intrinsics:
    """Calibrate from the views that ``find_corners`` gave.

    Raises:
        ValueError: Fewer than five views.
    """
    if len(views) < MIN_PICTURES:
        raise CalibrationRefusedError(
            f"the board was seen in {len(views)} pictures, {MIN_PICTURES} are needed"
        )
    points = [view[0] for view in views]
    pixels = [view[1] for view in views]
    start = np.array([[width, 0.0, 0.5 * (width - 1)], [0.0, width, 0.5 * (height - 1)], [0.0, 0.0, 1.0]])
    _, matrix, distortion, turns, shifts, sigma, _, _ = cv2.calibrateCameraExtended(
        points,
        pixels,
        (width, height),
        start,
        np.zeros(5),
        flags=cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_K3,
    )
    residual = []
    for point, pixel, turn, shift in zip(points, pixels, turns, shifts, strict=True):
        model, _ = cv2.projectPoints(point, turn, shift, matrix, distortion)
        residual.append(pixel - np.asarray(model).reshape(-1, 2))
    k = [float(value) for value in np.asarray(distortion).ravel()[:5]]
    return Intrinsics(
        fx=float(matrix[0, 0]),
        fy=float(matrix[1, 1]),
        cx=float(matrix[0, 2]),
        cy=float(matrix[1, 2]),
        distortion=(k[0], k[1], k[2], k[3], k[4]),
        sigma=tuple(float(value) for value in np.asarray(sigma).ravel()[:9]),
        residual_px=np.concatenate(residual).astype(np.float64),
        pictures=len(views),
    )
