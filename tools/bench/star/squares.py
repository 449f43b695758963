"""A ceiling of printed squares, ArUco or AprilTag, drawn and solved for the same camera and poses."""

import time
from collections.abc import Callable, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.star.laboratory import Frame
from bench.star.rigid import rigid_pose
from bench.star.score import Answer, Score
from bench.unit import blur_s
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.rays import ceiling_points
from groundstation.star_tracking.star_catalogue import StarCatalogue

KINDS = {"ArUco 4x4": cv2.aruco.DICT_4X4_50, "AprilTag 36h11": cv2.aruco.DICT_APRILTAG_36h11}
"""OpenCV's dictionaries; its detector reads both."""
SQUARE_M, PITCH_M, COLUMNS, COUNT = 0.15, 0.6, 8, 48
INK_DN, PAPER_DN, NOISE_DN, BLUR_PX = 20.0, 170.0, 2.0, 0.7
_FINE = 3
"""Drawn so many times finer than the camera sees."""
TILE_PX = 120


class SquareCeiling:
    """8 x 6 squares of 0.15 m, 0.6 m apart: 40 corners in a picture, about as many as LEDs."""

    def __init__(self, name: str, camera: CameraCalibration, catalogue: StarCatalogue) -> None:
        self._dictionary = cv2.aruco.getPredefinedDictionary(KINDS[name])
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(self._dictionary, settings)
        self._camera = camera
        x, y = float(catalogue.x_m.min()), float(catalogue.y_m.min())
        number = np.arange(COUNT)
        self._centre = np.column_stack((number % COLUMNS, number // COLUMNS)) * PITCH_M + (x + 0.2, y + 0.2)
        self._tiles = np.stack(
            [cv2.aruco.generateImageMarker(self._dictionary, n, TILE_PX) for n in number.tolist()]
        )
        v, u = np.indices((camera.height * _FINE, camera.width * _FINE), dtype=float)
        u, v = (u.ravel() + 0.5) / _FINE - 0.5, (v.ravel() + 0.5) / _FINE - 0.5
        self._fine_m, _ = ceiling_points(camera, u, v)
        half = 0.5 * SQUARE_M
        self._corner = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])

    def score(self, frames: Sequence[Frame], say: Callable[[str], None]) -> Score:
        """Draw the squares at the frames' poses and solve; the whole time counts as solving."""
        rng, score = np.random.default_rng(9), Score()
        for number, frame in enumerate(frames):
            say(f"star: squares, {number} of {len(frames)} pictures")
            image = self._draw(np.asarray(frame.pose), rng)
            unit = 1e3 * blur_s(image)
            begin = time.process_time()
            answer = self._solve(image)
            score.take(frame, answer, unit, 0.0, 1e3 * (time.process_time() - begin))
        return score

    def _nearest(self, x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> NDArray[np.int64]:
        """Number of the square nearest to each point of the ceiling."""
        column, row = np.rint((np.stack((x_m, y_m)) - self._centre[0][:, None]) / PITCH_M).astype(np.int64)
        return np.clip(row, 0, COUNT // COLUMNS - 1) * COLUMNS + np.clip(column, 0, COLUMNS - 1)

    def _draw(self, pose: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.uint8]:
        height, width, q = self._camera.height, self._camera.width, self._fine_m
        c, s = np.cos(pose[2]), np.sin(pose[2])
        x = pose[0] + c * q[:, 0] - s * q[:, 1]
        y = pose[1] + s * q[:, 0] + c * q[:, 1]
        number = self._nearest(x, y)
        dx, dy = x - self._centre[number, 0], y - self._centre[number, 1]
        on = np.flatnonzero((np.abs(dx) < 0.5 * SQUARE_M) & (np.abs(dy) < 0.5 * SQUARE_M))
        column, row = (((d[on] / SQUARE_M + 0.5) * TILE_PX).astype(int) for d in (dx, dy))
        picture = np.full(len(x), PAPER_DN)
        picture[on] = INK_DN + (PAPER_DN - INK_DN) / 255.0 * self._tiles[number[on], row, column]
        fine = picture.reshape(height * _FINE, width * _FINE)
        small = cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA)
        image = cv2.GaussianBlur(small, (0, 0), BLUR_PX) + rng.normal(0.0, NOISE_DN, small.shape)
        return np.clip(image, 0, 255).astype(np.uint8)

    def _solve(self, image: NDArray[np.uint8]) -> Answer | None:
        corners, numbers, _ = self._detector.detectMarkers(image)
        if numbers is None or len(numbers) == 0:
            return None
        known = np.asarray(numbers).ravel()
        inside = known < COUNT
        if not inside.any():
            return None
        uv = np.concatenate([c.reshape(4, 2) for c, ok in zip(corners, inside, strict=True) if ok])
        q, _ = ceiling_points(self._camera, uv[:, 0].astype(float), uv[:, 1].astype(float))
        goal = np.concatenate([self._centre[n] + self._corner for n in known[inside]])
        return rigid_pose(q @ np.array([1.0, 1j]), goal @ np.array([1.0, 1j]))
