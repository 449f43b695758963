"""Made-up skies and flights for tests of several rooms.

Skies are painted through OpenCV's projection, not through ours; flights with truth are made by the
laboratory in tools/fusion_truth.py.
"""

import importlib
import sys
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType

import cv2
import numpy as np
import pytest

from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.star_catalogue import StarCatalogue

CAMERA = CameraCalibration(
    width=640,
    height=480,
    fx=598.0,
    fy=600.5,
    cx=317.4,
    cy=242.8,
    distortion=(-0.09, 0.05, 0.0008, -0.0007, 0.0),
    ceiling_height_above_camera_m=2.3,
    mount_offset_body_m=(0.02, 0.04, 0.0),
    mount_yaw_rad=-0.05,
    mount_tilt_x_rad=0.004,
    mount_tilt_y_rad=0.006,
)


@dataclass(frozen=True)
class SkyPainter:
    """Paints what the camera sees at a pose, electrons first."""

    camera: CameraCalibration
    stars_m: np.ndarray
    flux_e: np.ndarray
    psf_px: float = 1.2
    read_noise_e: float = 25.0
    dn_per_e: float = 0.04
    background_dn: float = 10.0
    hot_pixels: tuple[tuple[int, int], ...] = field(default=((50, 60), (300, 400)))

    def project(self, x, y, heading, stars=None):
        """Pixels (n, 2) of ceiling stars (n, 2) seen from a pose; nan where behind or far outside."""
        stars = self.stars_m if stars is None else stars
        c, s = np.cos(heading), np.sin(heading)
        offset = np.asarray(self.camera.mount_offset_body_m)
        flat = (stars - [x, y]) @ np.array([[c, -s], [s, c]])  # rows: R(-heading) (star - position)
        body = np.column_stack((flat, np.full(len(flat), self.camera.ceiling_height_above_camera_m)))
        seen = (body - [*offset[:2], 0.0]) @ self.camera.body_from_camera()
        uv, _ = cv2.projectPoints(
            seen[:, None],
            np.zeros(3),
            np.zeros(3),
            self.camera.matrix_px,
            np.asarray(self.camera.distortion),
        )
        uv = uv[:, 0]
        far = np.hypot(seen[:, 0], seen[:, 1]) > 1.2 * seen[:, 2]
        uv[far] = np.nan
        return uv

    def paint(self, rng, pose, velocity=(0.0, 0.0, 0.0), exposure_s=0.01, readout_s=0.0, lit=None, lights=()):
        """Grey picture (h, w) uint8; ``pose`` at the middle of the exposure of the middle row."""
        h, w = self.camera.height, self.camera.width
        electrons = np.full((h, w), self.background_dn / self.dn_per_e)
        velocity = np.asarray(velocity, float)
        steps = 41 if velocity.any() else 1
        times = ((np.arange(steps) + 0.5) / steps - 0.5) * exposure_s
        lit = np.ones(len(self.stars_m), bool) if lit is None else lit
        home = self.project(*pose)
        rows = np.nan_to_num(home[:, 1])
        delay = (rows / (h - 1) - 0.5) * readout_s
        for star in np.flatnonzero(lit & np.isfinite(home).all(axis=1)):
            if not (-60 < home[star, 0] < w + 60 and -60 < home[star, 1] < h + 60):
                continue
            at = [
                self.project(*(np.asarray(pose) + velocity * (t + delay[star])), self.stars_m[[star]])[0]
                for t in times
            ]
            for uv in at:
                self._add(electrons, uv, self.flux_e[star] / len(at))
        for u, v, flux in lights:
            self._add(electrons, (u, v), flux)
        electrons = rng.poisson(electrons) + rng.normal(0.0, self.read_noise_e, electrons.shape)
        for row, column in self.hot_pixels:
            electrons[row, column] += 3000.0
        return np.clip(np.rint(electrons * self.dn_per_e), 0, 255).astype(np.uint8)

    def _add(self, electrons, uv, flux):
        h, w = electrons.shape
        u0, v0 = round(uv[0]), round(uv[1])
        reach = int(np.ceil(6 * self.psf_px))
        rows = np.arange(max(v0 - reach, 0), min(v0 + reach + 1, h))
        columns = np.arange(max(u0 - reach, 0), min(u0 + reach + 1, w))
        if len(rows) == 0 or len(columns) == 0:
            return
        a = np.exp(-0.5 * ((columns - uv[0]) / self.psf_px) ** 2)
        b = np.exp(-0.5 * ((rows - uv[1]) / self.psf_px) ** 2)
        norm = flux / (2 * np.pi * self.psf_px**2)
        electrons[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] += norm * np.outer(b, a)

    def visible(self, pose, margin_px=6.0):
        """Rows of the stars inside the picture."""
        uv = self.project(*pose)
        inside = (uv > margin_px).all(axis=1)
        inside &= (uv[:, 0] < self.camera.width - 1 - margin_px) & (
            uv[:, 1] < self.camera.height - 1 - margin_px
        )
        return np.flatnonzero(inside)


def scatter_stars(rng, count, width_m, height_m, apart_m=0.12):
    """Random stars that keep a distance, shape (count, 2)."""
    stars = []
    while len(stars) < count:
        candidate = rng.uniform((0.0, 0.0), (width_m, height_m))
        if all(np.hypot(*(candidate - s)) > apart_m for s in stars):
            stars.append(candidate)
    return np.array(stars)


@pytest.fixture(scope="session")
def painter():
    rng = np.random.default_rng(20260111)
    stars = scatter_stars(rng, 180, 5.0, 4.0)
    return SkyPainter(CAMERA, stars, rng.uniform(15e3, 60e3, len(stars)))


@pytest.fixture(scope="session")
def catalogue(painter):
    return StarCatalogue.from_positions(painter.stars_m)


@pytest.fixture(scope="session")
def camera():
    return CAMERA


ROOT = Path(__file__).parents[2]


@cache
def _laboratory() -> ModuleType:
    tools = str(ROOT / "tools")
    sys.path.insert(0, tools)  # its parts import each other by name
    try:
        return importlib.import_module("fusion_truth")
    finally:
        sys.path.remove(tools)


@pytest.fixture(scope="session")
def fusion_truth() -> ModuleType:
    return _laboratory()


@pytest.fixture(scope="session")
def make_folder(tmp_path_factory):
    """Write a data set once per settings and return its folder."""
    made = {}

    def make(**settings) -> Path:
        key = tuple(sorted(settings.items()))
        if key not in made:
            laboratory = _laboratory()
            made[key] = tmp_path_factory.mktemp("fusion")
            laboratory.write(laboratory.make(laboratory.Laboratory(**settings)), made[key])
        return made[key]

    return make
