"""tetra3rs under a ceiling: the LEDs as stars of a small patch of sky.

Its only way in for an own catalogue is the binary format of its Gaia catalogue (magic ``GDR3``, version,
count; per star id, right ascension, declination, magnitude, two proper motions, little endian, 36 bytes).
The ceiling becomes a patch of 1 degree per metre about right ascension 180, looked at by a camera whose
pictures are levelled and free of distortion; the matched stars then give the pose by least squares.
"""

import importlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.star.rigid import rigid_pose
from bench.star.score import Answer
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots
from groundstation.star_tracking.rays import CeilingRays
from groundstation.star_tracking.star_catalogue import StarCatalogue

DEG_M = 1.0
RIGHT_ASCENSION_DEG = 180.0
STAR = np.dtype(
    [("id", "<i8"), ("ra", "<f8"), ("dec", "<f8"), ("magnitude", "<f4"), ("motion", "<f4", 2)], align=False
)
HEADER = np.dtype([("magic", "S4"), ("version", "<u4"), ("count", "<u8")])


class Tetra:
    """tetra3rs with a database of the ceiling.

    Args:
        catalogue: The LEDs.
        camera: For levelling and for the field of view.
        folder: Where its catalogue file is written.
        patterns_per_field: Density of its patterns; what decides how many pictures it identifies.
        settings: Of its solver.

    Raises:
        ImportError: It is not installed.
    """

    def __init__(
        self,
        catalogue: StarCatalogue,
        camera: CameraCalibration,
        folder: Path,
        patterns_per_field: int,
        **settings: float,
    ) -> None:
        library = importlib.import_module("tetra3rs")
        self._leds = catalogue.x_m + 1j * catalogue.y_m
        self._middle = self._leds.mean()
        self._rays = CeilingRays(camera)
        self._settings = settings
        self._width_px, self._height_px = camera.width, camera.height
        fov_deg = float(
            np.degrees(2 * np.arctan(0.5 * camera.width * self._rays.scale_m_px * np.radians(DEG_M)))
        )
        path = folder / f"ceiling_{patterns_per_field}.bin"
        path.write_bytes(self._gaia_file())
        self._database = library.SolverDatabase.generate_from_gaia(
            str(path),
            max_fov_deg=fov_deg,
            patterns_per_lattice_field=patterns_per_field,
            epoch_proper_motion_year=None,
        )
        self._fov_deg = fov_deg
        self.patterns = self._database.num_patterns

    def _gaia_file(self) -> bytes:
        """The LEDs by inverse gnomonic projection about the ceiling's middle, all about as bright."""
        xi, eta = np.radians(DEG_M) * np.array([self._leds - self._middle]).view(float).reshape(-1, 2).T
        stars = np.zeros(len(xi), STAR)
        stars["id"] = np.arange(1, len(xi) + 1)
        stars["ra"] = RIGHT_ASCENSION_DEG + np.degrees(np.arctan2(xi, 1.0))
        stars["dec"] = np.degrees(np.arctan2(eta, np.hypot(1.0, xi)))
        stars["magnitude"] = np.linspace(4.0, 4.5, len(xi))
        return np.array([(b"GDR3", 1, len(xi))], HEADER).tobytes() + stars.tobytes()

    def solve(self, spots: Spots) -> Answer | None:
        """Pose from spots, or None."""
        if len(spots) < 4:
            return None
        q = self._rays.look_up(spots.u_px, spots.v_px).q_body_m
        return self._pose(q)

    def _pose(self, q: NDArray[np.complex128]) -> Answer | None:
        centroids = np.column_stack((q.real, q.imag, np.linspace(2.0, 1.0, len(q))))
        centroids[:, :2] /= self._rays.scale_m_px
        answer = self._database.solve_from_centroids(
            centroids,
            fov_estimate_deg=self._fov_deg,
            image_width=self._width_px,
            image_height=self._height_px,
            **self._settings,
        )
        if not answer:
            return None
        spot = np.asarray(answer.matched_centroids, dtype=int)
        star = np.asarray(answer.matched_catalog_ids, dtype=int) - 1
        return rigid_pose(q[spot], self._leds[star])
