"""Detection in the compiled core: one call from the picture to its spots (``core/detect.c``)."""

import ctypes

import numpy as np
from numpy.typing import NDArray

from groundstation.core.library import Core

_ALIGNMENT = 64
_COLUMNS = 9  # of a FittedSpot: u, v, flux, cov uu, uv, vv, elongation, streak u, v


class _Settings(ctypes.Structure):
    """``DetectorSettings`` of detect.c, field by field."""

    _fields_ = (
        ("threshold_sigmas", ctypes.c_double),
        ("hot_pixel_ratio", ctypes.c_double),
        ("gain_dn_per_electron", ctypes.c_double),
        ("saturation_dn", ctypes.c_int32),
        ("max_spots", ctypes.c_int32),
        ("max_lit", ctypes.c_int32),
    )


class DetectionSummary(ctypes.Structure):
    """``DetectionSummary`` of detect.c, field by field."""

    background_dn: float
    noise_dn: float
    hot_pixels: int
    cut_by_edge: int
    is_flooded: int
    _fields_ = (
        ("background_dn", ctypes.c_double),
        ("noise_dn", ctypes.c_double),
        ("hot_pixels", ctypes.c_int32),
        ("cut_by_edge", ctypes.c_int32),
        ("is_flooded", ctypes.c_int32),
    )


class CoreDetector:
    """Finds spots, and owns the memory that this takes; one thread at a time.

    The arguments are the fields of ``DetectorSettings``.

    Raises:
        CoreError: ``core`` has no compiled detection.
    """

    def __init__(
        self,
        core: Core,
        *,
        threshold_sigmas: float,
        hot_pixel_ratio: float,
        saturation_dn: int,
        gain_dn_per_electron: float,
        max_spots: int,
        max_lit_ratio: float,
    ) -> None:
        pointer, number = ctypes.c_void_p, ctypes.c_int32
        self._bytes_needed = core.function(
            "gs_detect_scratch_bytes", ctypes.c_size_t, number, number, pointer
        )
        self._detect = core.function(
            "gs_detect",
            number,
            *(pointer, ctypes.c_ssize_t, number, number),
            *(pointer, pointer, pointer, pointer),
        )
        self._max_lit_ratio = max_lit_ratio
        self._settings = _Settings(
            threshold_sigmas, hot_pixel_ratio, gain_dn_per_electron, saturation_dn, max_spots, 0
        )
        self._shape = (0, 0)
        self._scratch = np.empty(0, np.uint8)
        self._scratch_address = 0
        self._fitted = np.empty((max(max_spots, 1), _COLUMNS))
        self._summary = DetectionSummary()
        self._settings_address = ctypes.addressof(self._settings)
        self._results = (self._fitted.ctypes.data, ctypes.addressof(self._summary))

    def find(self, image: NDArray[np.uint8]) -> tuple[NDArray[np.float64], DetectionSummary]:
        """Give a row per spot, brightest first (n, 9), and what was found besides.

        Both are overwritten by the next call.

        Args:
            image: Grey picture (h, w), uint8, at least 32 x 32.
        """
        if image.strides[1] != 1:
            image = np.ascontiguousarray(image)
        rows, columns = image.shape
        if image.shape != self._shape:
            self._make_room(rows, columns)
        count = self._detect(
            *(image.ctypes.data, image.strides[0], rows, columns),
            *(self._settings_address, self._scratch_address, *self._results),
        )
        return self._fitted[:count], self._summary

    def _make_room(self, rows: int, columns: int) -> None:
        self._settings.max_lit = int(self._max_lit_ratio * rows * columns)
        needed: int = self._bytes_needed(rows, columns, self._settings_address)
        self._scratch = np.empty(needed + _ALIGNMENT, np.uint8)
        self._scratch_address = -(-self._scratch.ctypes.data // _ALIGNMENT) * _ALIGNMENT
        self._shape = (rows, columns)
