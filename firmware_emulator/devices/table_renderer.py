"""The pictures of the camera over the table, drawn by `firmware_emulator.overhead`."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from firmware_emulator.devices.overhead_camera import TableExposure
from firmware_emulator.overhead.scene import read_markings, read_overhead_camera
from firmware_emulator.overhead.table_view import Body, Light, TableView
from firmware_emulator.scene_files import SceneError


class TableRenderer:
    """Draws exposures of the table."""

    def __init__(self, view: TableView) -> None:
        self._view = view

    @classmethod
    def load(
        cls,
        camera: str | Path,
        circles: str | Path,
        bounds_m: Sequence[float],
        radii_m: Mapping[str, float],
        seed: Sequence[int],
    ) -> Self:
        """Make it from files.

        Args:
            camera: Camera file (JSON).
            circles: What each mock-up wears (TOML).
            bounds_m: Of the table: x_min, x_max, y_min, y_max.
            radii_m: Bumper radius of every mock-up of the scenario, by name.
            seed: Decides lamps, dirt and noise.

        Raises:
            SceneError: A file is missing or wrong, or a mock-up wears nothing.
        """
        optics, markings = read_overhead_camera(Path(camera)), read_markings(Path(circles))
        for name in radii_m:
            if name not in markings:
                raise SceneError(f"{circles}: has no table [{name}] for the vehicle of that name")
        bodies = {name: Body(markings[name], radius_m) for name, radius_m in radii_m.items()}
        x_min, x_max, y_min, y_max = bounds_m
        words = np.random.SeedSequence(list(seed))
        return cls(TableView(optics, (x_min, x_max, y_min, y_max), bodies, Light(), words))

    @staticmethod
    def exposure(fields: dict[str, Any]) -> TableExposure:
        """The exposure that `dataclasses.asdict` made into `fields`."""
        return TableExposure(**fields)

    def render(self, exposure: TableExposure) -> NDArray[np.uint8]:
        """The picture, shape (height, width, 3), blue-green-red."""
        return self._view.render(exposure.paths, exposure.sequence, exposure.hidden)
