"""The star camera and the sky it looks at: intrinsics, mount, catalogue of ceiling LEDs."""

from calibration.camera.errors import CalibrationFileError
from calibration.camera.models import CameraCalibration
from calibration.camera.star_catalogue import StarCatalogue

__all__ = ["CalibrationFileError", "CameraCalibration", "StarCatalogue"]
