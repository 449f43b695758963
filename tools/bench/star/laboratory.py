"""Pictures of the emulator's sky with their truth."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bench.rows import ROOT
from firmware_emulator.sky.scene import build_sky, read_camera, read_ceiling
from firmware_emulator.sky.sensor import SensorSettings
from firmware_emulator.sky.sky_camera import Shutter, SkyCamera
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.projection import project

RIG = ROOT / "calibration" / "rigs" / "emulated"
CAMERA_FILE, CEILING_FILE = RIG / "camera.json", RIG / "ceiling.csv"
TAGS = ("easy", "edge", "blur", "false-lights", "leds-out", "mixed", "sparse", "dark")
Triple = Sequence[float] | np.ndarray


@dataclass(frozen=True)
class Frame:
    """One picture with its truth; ``pose`` is None where no ceiling is shown."""

    tag: str
    image: np.ndarray
    pose: tuple[float, float, float] | None


class Laboratory:
    """The emulator's sky above one camera."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.leds = read_ceiling(CEILING_FILE)
        self.optics = read_camera(CAMERA_FILE)
        self.sky = build_sky(self.leds, np.random.SeedSequence(seed))
        self.settings = SensorSettings()
        self._number = 0
        self._cameras: dict[tuple[float, float], SkyCamera] = {}

    def picture(
        self,
        pose: Triple,
        velocity: Triple = (0.0, 0.0, 0.0),
        exposure_s: float = 0.01,
        readout_s: float = 0.0,
        *,
        is_sky_dead: bool = False,
        false_lights: float = 0.0,
    ) -> np.ndarray:
        """Picture whose middle of exposure is at the pose; velocity in table axes."""
        key = (exposure_s, readout_s)
        if key not in self._cameras:
            seed = np.random.SeedSequence(7)
            shutter = Shutter(exposure_s, readout_s)
            self._cameras[key] = SkyCamera(self.optics, self.sky, shutter, self.settings, seed)
        half = 0.5 * (exposure_s + readout_s) * np.asarray(velocity)
        self._number += 1
        start, end = np.asarray(pose) - half, np.asarray(pose) + half
        return self._cameras[key].render(
            tuple(start),
            tuple(end),
            sequence=self._number,
            is_sky_dead=is_sky_dead,
            false_lights=false_lights,
        )

    def poses(self, count: int, edge_m: float = 1.2) -> np.ndarray:
        """Random poses (count, 3) away from the edge."""
        low, high = self.leds.min(axis=0) + edge_m, self.leds.max(axis=0) - edge_m
        return np.column_stack(
            (self.rng.uniform(low, high, (count, 2)), self.rng.uniform(-np.pi, np.pi, count))
        )

    def frames(self, tag: str, count: int, stars: tuple[int, int] = (4, 10)) -> Iterator[Frame]:
        """Frames of one kind; sparse ones show so many stars, from first to last."""
        rng, leds = self.rng, len(self.leds)
        for pose in self.poses(count):
            velocity, exposure, changes = np.zeros(3), 0.01, {}
            self.sky.revive()
            if tag == "edge":
                pose[0] = self.leds[:, 0].min() + 0.4 if rng.random() < 0.5 else self.leds[:, 0].max() - 0.4
            if tag in ("blur", "mixed"):
                velocity, exposure = rng.uniform(-1.0, 1.0, 3) * (1.0, 1.0, 1.3), 0.033
            if tag in ("false-lights", "mixed"):
                changes["false_lights"] = float(rng.integers(5, 14))
            if tag in ("leds-out", "mixed"):
                self.sky.kill(np.flatnonzero(rng.random(leds) < rng.uniform(0.2, 0.5)))
            if tag == "sparse":
                self.sky.kill(self._all_but_a_few(pose, int(rng.integers(stars[0], stars[1] + 1))))
            if tag == "dark":
                changes |= {"is_sky_dead": True, "false_lights": float(rng.integers(10, 60))}
            image = self.picture(pose, velocity, exposure, **changes)
            yield Frame(tag, image, None if tag == "dark" else tuple(pose))
        self.sky.revive()

    def _all_but_a_few(self, pose: np.ndarray, left: int) -> np.ndarray:
        camera = CameraCalibration.load(CAMERA_FILE)
        uv, _ = project(camera, np.tile(pose, (len(self.leds), 1)), self.leds)
        inside = (uv > 8).all(axis=1) & (uv < (camera.width - 9, camera.height - 9)).all(axis=1)
        near = np.hypot(*(self.leds - pose[:2]).T) < 2.0
        kept = self.rng.permutation(np.flatnonzero(inside & near))[:left]
        return np.setdiff1d(np.arange(len(self.leds)), kept)


def spots_at(uv: np.ndarray, sigma_px: float = 0.03) -> Spots:
    """Spots without a picture."""
    n = len(uv)
    covariance = np.tile([sigma_px**2, 0.0, sigma_px**2], (n, 1))
    return Spots(
        uv[:, 0], uv[:, 1], np.linspace(9, 3, n), covariance, np.ones(n), np.zeros((n, 2)), 10.0, 1.0
    )
