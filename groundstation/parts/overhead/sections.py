"""Keys of a rig file for the camera over the table."""

from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.section import Delay, Positive, Section, Sigma


class OverheadCameraSection(Section):
    """The camera over the table: where it is opened, its files, its delay and the floor of its errors.

    ``circles`` is what each mock-up wears. The sigmas are what calibration of the camera and gluing of the
    circles leave in every fix, beyond the covariance that comes with it.
    """

    address: str
    camera: RigFile
    circles: RigFile
    delay_s: Delay = 0.0
    delay_sigma_s: Delay = 0.002
    timeout_s: Positive = 2.0
    sigma_xy_m: Sigma = 0.001
    sigma_heading_rad: Sigma = 0.003


class OverheadOfRig(Section):
    """Keys of the rig."""

    overhead_camera: OverheadCameraSection | None = None
