"""astroalign under a ceiling: asterisms of the levelled spots against those of the catalogue."""

import importlib

import numpy as np
from numpy.typing import NDArray

from bench.star.score import Answer
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.star_catalogue import StarCatalogue

CONTROL_POINTS = 200
"""Of the catalogue; its own 50 would leave most of the ceiling out."""


class Astroalign:
    """astroalign with the catalogue as its target.

    Raises:
        ImportError: It is not installed.
    """

    def __init__(self, catalogue: StarCatalogue, camera: CameraCalibration) -> None:
        self._library = importlib.import_module("astroalign")
        self._rays = CeilingRays(camera)
        self._target = np.stack((catalogue.x_m, catalogue.y_m), axis=1) / self._rays.scale_m_px

    def solve(self, spots: Spots) -> Answer | None:
        """Pose from spots, or None; lengths are in pixels, as its tolerance is."""
        if len(spots) < 3:
            return None
        q = self._rays.look_up(spots.u_px, spots.v_px).q_body_m / self._rays.scale_m_px
        source: NDArray[np.float64] = np.stack((q.real, q.imag), axis=1)
        try:
            found, _ = self._library.find_transform(source, self._target, max_control_points=CONTROL_POINTS)
        except self._library.MaxIterError:
            return None
        x_m, y_m = self._rays.scale_m_px * found.params[:2, 2]
        return float(x_m), float(y_m), float(found.rotation)
