"""Other ways to find one's pose under a ceiling, for ``bench_star_tracker.py``."""

import importlib
import time
from collections.abc import Sequence

import cv2
import numpy as np
from bench_star_laboratory import Frame

from calibration.camera import CameraCalibration, StarCatalogue
from calibration.camera.survey.overlap import rigid_fit
from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.rays import CeilingRays, ceiling_points

_SQUARE_M, _PITCH_M = 0.15, 0.6


def astroalign(
    frames: list[Frame], catalogue: StarCatalogue, rays: CeilingRays
) -> tuple[float, float, int] | None:
    """(ms, mm, found): asterisms of astroalign on the levelled spots, catalogue as the target."""
    try:
        library = importlib.import_module("astroalign")
    except ImportError:
        return None
    target = np.stack((catalogue.x_m, catalogue.y_m), axis=1) / rays.scale_m_px  # its tolerance is in px
    times, errors = [], []
    for frame in frames:
        begin = time.process_time()
        spots = detect(frame.image)
        q = rays.look_up(spots.u_px, spots.v_px).q_body_m
        source = np.stack((q.real, q.imag), axis=1) / rays.scale_m_px
        try:
            found, _ = library.find_transform(source, target, max_control_points=200)
        except library.MaxIterError:
            found = None
        times.append(1e3 * (time.process_time() - begin))
        if found is not None:
            origin = rays.scale_m_px * found.params[:2, 2]
            errors.append(1e3 * np.hypot(*(origin - frame.pose[:2])))
    good = [e for e in errors if e < 20.0]
    return float(np.median(times)), float(np.sqrt(np.mean(np.square(good)))) if good else np.nan, len(good)


PEERS = {"astroalign": astroalign}


class SquareCeiling:
    """A ceiling of printed squares of 0.15 m, 0.6 m apart, drawn and solved for the same camera."""

    def __init__(self, name: str, camera: CameraCalibration, catalogue: StarCatalogue) -> None:
        kind = cv2.aruco.DICT_4X4_50 if name.startswith("ArUco") else cv2.aruco.DICT_APRILTAG_36h11
        self._dictionary = cv2.aruco.getPredefinedDictionary(kind)
        settings = cv2.aruco.DetectorParameters()
        settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._detector = cv2.aruco.ArucoDetector(self._dictionary, settings)
        self._camera = camera
        x, y = float(catalogue.x_m.min()), float(catalogue.y_m.min())
        self._centre = np.array(
            [(x + 0.2 + _PITCH_M * (i % 8), y + 0.2 + _PITCH_M * (i // 8)) for i in range(48)]
        )  # 8 x 6 squares
        half = 0.5 * _SQUARE_M
        self._corner = np.array([(-half, -half), (half, -half), (half, half), (-half, half)])

    def measure(self, poses: Sequence[Sequence[float] | None]) -> tuple[float, float, int]:
        """(median ms, RMS mm, found) over poses."""
        rng, times, errors = np.random.default_rng(9), [], []
        for pose in poses:
            image = self._draw(np.asarray(pose), rng)
            begin = time.process_time()
            answer = self._solve(image)
            times.append(1e3 * (time.process_time() - begin))
            if answer is not None:
                errors.append(1e3 * abs(answer - complex(pose[0], pose[1])))
        good = [e for e in errors if e < 20.0]
        rms = float(np.sqrt(np.mean(np.square(good)))) if good else np.nan
        return float(np.median(times)), rms, len(good)

    def _draw(self, pose: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        height, width, scale = self._camera.height, self._camera.width, 3
        v, u = np.indices((height * scale, width * scale), dtype=float)
        u, v = (u.ravel() + 0.5) / scale - 0.5, (v.ravel() + 0.5) / scale - 0.5
        q, _ = ceiling_points(self._camera, u, v)
        c, s = np.cos(pose[2]), np.sin(pose[2])
        x = pose[0] + c * q[:, 0] - s * q[:, 1]
        y = pose[1] + s * q[:, 0] + c * q[:, 1]
        picture = np.full(len(x), 170.0)
        for number, centre in enumerate(self._centre):
            dx, dy = x - centre[0], y - centre[1]
            mine = (np.abs(dx) < 0.5 * _SQUARE_M) & (np.abs(dy) < 0.5 * _SQUARE_M)
            if not mine.any():
                continue
            tile = cv2.aruco.generateImageMarker(self._dictionary, number, 120)
            column = ((dx[mine] / _SQUARE_M + 0.5) * 119.99).astype(int)
            row = ((dy[mine] / _SQUARE_M + 0.5) * 119.99).astype(int)
            picture[mine] = 20.0 + 0.6 * tile[row, column]
        fine = picture.reshape(height * scale, width * scale)
        image = cv2.GaussianBlur(cv2.resize(fine, (width, height), interpolation=cv2.INTER_AREA), (0, 0), 0.7)
        return np.clip(image + rng.normal(0.0, 2.0, image.shape), 0, 255).astype(np.uint8)

    def _solve(self, image: np.ndarray) -> complex | None:
        corners, numbers, _ = self._detector.detectMarkers(image)
        if numbers is None or len(numbers) == 0:
            return None
        known = np.asarray(numbers).ravel()
        inside = known < len(self._centre)
        if not inside.any():
            return None
        uv = np.concatenate([c.reshape(4, 2) for c, ok in zip(corners, inside, strict=True) if ok])
        q, _ = ceiling_points(self._camera, uv[:, 0].astype(float), uv[:, 1].astype(float))
        goal = np.concatenate([self._centre[n] + self._corner for n in known[inside]])
        q, goal = q @ np.array([1.0, 1j]), goal @ np.array([1.0, 1j])
        turn, shift = rigid_fit(q, goal)
        for _ in range(3):  # clip what does not fit
            residual = np.abs(turn * q + shift - goal)
            kept = residual <= max(3.0 * float(np.median(residual)), 1e-6)
            turn, shift = rigid_fit(q[kept], goal[kept])
        return shift
