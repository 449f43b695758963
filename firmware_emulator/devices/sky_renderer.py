"""The pictures of one star camera, drawn by `firmware_emulator.sky`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.devices.star_camera import Exposure
from firmware_emulator.sky.scene import build_sky, read_camera, read_ceiling
from firmware_emulator.sky.sensor import SensorSettings
from firmware_emulator.sky.sky import SkyFailures
from firmware_emulator.sky.sky_camera import Shutter, SkyCamera


class SkyRenderer:
    """Draws exposures (`firmware_emulator.device_kind.Renderer`)."""

    def __init__(self, camera: SkyCamera) -> None:
        self._camera = camera

    @classmethod
    def load(
        cls,
        ceiling: str | Path,
        camera: str | Path,
        exposure_s: float,
        readout_s: float,
        sky_seed: Sequence[int],
        camera_seed: Sequence[int],
    ) -> Self:
        """Make it from files.

        Args:
            ceiling: Star list, CSV `id,x_m,y_m`, ceiling coordinates.
            camera: Camera file (JSON): intrinsics, distortion, mount.
            exposure_s: How long a row is exposed.
            readout_s: From the first row's exposure to the last one's.
            sky_seed: Decides the LEDs' brightness and the places of false lights; one sky for all cameras.
            camera_seed: Decides this camera's noise and hot pixels.

        Raises:
            firmware_emulator.sky.scene.SceneError: A file is missing or wrong.
        """
        sky = build_sky(read_ceiling(Path(ceiling)), np.random.SeedSequence(list(sky_seed)))
        optics = read_camera(Path(camera))
        seed = np.random.SeedSequence(list(camera_seed))
        return cls(SkyCamera(optics, sky, Shutter(exposure_s, readout_s), SensorSettings(), seed))

    @staticmethod
    def exposure(fields: dict[str, Any]) -> Exposure:
        """The exposure that `dataclasses.asdict` made into `fields`."""
        failures, lower = fields["sky_failures"], fields["lower"]
        given = fields | {
            "sky_failures": None if failures is None else SkyFailures(**failures),
            "lower": None if lower is None else SkyRenderer.exposure(lower),
        }
        return Exposure(**given)

    def render(self, exposure: Exposure) -> NDArray[np.uint8]:
        """The picture, shape (height, width)."""
        picture = self._draw(exposure)
        if exposure.lower is not None:
            half = picture.shape[0] // 2
            picture[half:] = self._draw(exposure.lower)[half:]
        return picture

    def _draw(self, exposure: Exposure) -> NDArray[np.uint8]:
        return self._camera.render(
            exposure.start,
            exposure.end,
            sequence=exposure.noise,
            is_sky_dead=exposure.is_sky_dead,
            false_lights=exposure.false_lights,
            sky_failures=exposure.sky_failures,
        )
