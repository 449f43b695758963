"""Star list and camera file to a renderer of pictures."""

import csv
import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.devices.star_camera import Exposure
from firmware_emulator.sky.optics import CameraOptics
from firmware_emulator.sky.sensor import SensorSettings
from firmware_emulator.sky.sky import Sky
from firmware_emulator.sky.sky_camera import Shutter, SkyCamera

_BRIGHTNESS_SPREAD = 0.15  # LEDs of one batch, standard deviation of the logarithm
_DISTORTION_TERMS = 5


class SceneError(ValueError):
    """A file of the scene cannot be used; the message is one sentence naming it."""


class SceneRenderer:
    """Draws what one star camera sees (`firmware_emulator.devices.star_camera.Renderer`)."""

    def __init__(self, camera: SkyCamera) -> None:
        self._camera = camera

    @classmethod
    def load(
        cls,
        ceiling: str | Path,
        camera: str | Path,
        shutter: Shutter,
        sky_seed: Sequence[int],
        camera_seed: Sequence[int],
    ) -> Self:
        """Make it from files.

        Args:
            ceiling: Star list, CSV `id,x_m,y_m`, ceiling coordinates.
            camera: Camera file (JSON): intrinsics, distortion, mount.
            shutter: Exposure and readout.
            sky_seed: Decides the LEDs' brightness and the places of false lights; one sky for all cameras.
            camera_seed: Decides this camera's noise and hot pixels.

        Raises:
            SceneError: A file is missing or wrong.
        """
        sky = load_sky(Path(ceiling), np.random.SeedSequence(list(sky_seed)))
        seed = np.random.SeedSequence(list(camera_seed))
        return cls(SkyCamera(load_optics(Path(camera)), sky, shutter, SensorSettings(), seed))

    def render(self, exposure: Exposure) -> NDArray[np.uint8]:
        """The picture, shape (height, width)."""
        return self._camera.render(
            exposure.start,
            exposure.end,
            sequence=exposure.sequence,
            is_sky_dead=exposure.is_sky_dead,
            false_lights=exposure.false_lights,
        )


def load_sky(path: Path, seed: np.random.SeedSequence) -> Sky:
    """The LEDs of a star list.

    Raises:
        SceneError: The file is missing or wrong.
    """
    try:
        with path.open(newline="", encoding="utf-8") as file:
            places = [(float(row["x_m"]), float(row["y_m"])) for row in csv.DictReader(file)]
    except OSError as error:
        raise SceneError(f"star list {path} cannot be read: {error.strerror}") from error
    except KeyError as error:
        raise SceneError(f"star list {path} has no column {error}") from error
    except (ValueError, TypeError, csv.Error) as error:
        raise SceneError(f"star list {path} has a row without two numbers: {error}") from error
    rng = np.random.default_rng(seed)
    try:
        return Sky(places, np.exp(_BRIGHTNESS_SPREAD * rng.standard_normal(len(places))), rng)
    except ValueError as error:
        raise SceneError(f"star list {path} makes no sky: {error}") from error


def load_optics(path: Path) -> CameraOptics:
    """The optics of a camera file.

    Raises:
        SceneError: The file is missing or wrong.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SceneError(f"camera file {path} cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise SceneError(f"camera file {path} is no JSON: {error}") from error
    try:
        k1, k2, p1, p2, k3 = _numbers(data, "dist_k1_k2_p1_p2_k3", _DISTORTION_TERMS)
        offset = _numbers(data, "mount_offset_body_m", 3)
        return CameraOptics(
            width_px=int(data["width"]),
            height_px=int(data["height"]),
            focal_px=(float(data["fx"]), float(data["fy"])),
            centre_px=(float(data["cx"]), float(data["cy"])),
            distortion=(k1, k2, p1, p2, k3),
            ceiling_height_m=float(data["ceiling_height_above_camera_m"]),
            offset_body_m=(offset[0], offset[1]),
            yaw_rad=float(data["mount_yaw_rad"]),
            tilt_x_rad=float(data["mount_tilt_x_rad"]),
            tilt_y_rad=float(data["mount_tilt_y_rad"]),
        )
    except KeyError as error:
        raise SceneError(f"camera file {path} has no key {error}") from error
    except (TypeError, ValueError) as error:
        raise SceneError(f"camera file {path} has a wrong value: {error}") from error


def _numbers(data: dict[str, object], key: str, count: int) -> list[float]:
    values = data[key]
    if not isinstance(values, list) or len(values) != count:
        raise ValueError(f"{key} must be {count} numbers")
    numbers = [float(value) for value in values]
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{key} holds a number that is not finite")
    return numbers
