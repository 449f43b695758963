"""The pictures of one side camera, drawn by `firmware_emulator.side_view`."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.devices.side_camera import SideExposure
from firmware_emulator.scene_files import SceneError
from firmware_emulator.side_view.scene import read_hulls, read_side_camera
from firmware_emulator.side_view.side_view import SideView, SunLamp


class SideRenderer:
    """Draws exposures (`firmware_emulator.device_kind.Renderer`)."""

    def __init__(self, view: SideView) -> None:
        self._view = view

    @classmethod
    def load(
        cls,
        camera: str | Path,
        bodies: str | Path,
        seen: Sequence[str],
        lamp_deg: Sequence[float],
        lamp_level_dn: float,
        ambient_ratio: float,
        seed: Sequence[int],
    ) -> Self:
        """Make it from files.

        Args:
            camera: Camera file (JSON).
            bodies: What every mock-up looks like from the side (TOML).
            seen: Names of the other mock-ups.
            lamp_deg: Azimuth and elevation of the direction towards the sun lamp.
            lamp_level_dn: Grey level of a white surface that faces it.
            ambient_ratio: Light from everywhere else, as a share of that.
            seed: Decides noise and hot pixels.

        Raises:
            FileError: A file is missing or wrong, or has no table for a mock-up.
        """
        optics, hulls = read_side_camera(Path(camera)), read_hulls(Path(bodies))
        for name in seen:
            if name not in hulls:
                raise SceneError(f"{bodies}: has no table [{name}] for the vehicle of that name")
        azimuth_rad, elevation_rad = map(math.radians, lamp_deg)
        lamp = SunLamp(azimuth_rad, elevation_rad, lamp_level_dn, ambient_ratio)
        return cls(SideView(optics, hulls, lamp, np.random.SeedSequence(list(seed))))

    @staticmethod
    def exposure(fields: dict[str, Any]) -> SideExposure:
        """The exposure that `dataclasses.asdict` made into `fields`."""
        return SideExposure(**fields)

    def render(self, exposure: SideExposure) -> NDArray[np.uint8]:
        """The picture, shape (height, width)."""
        return self._view.render(
            exposure.own,
            exposure.others,
            exposure.noise,
            is_dark=exposure.is_dark,
            covered_share=exposure.covered_share,
        )
