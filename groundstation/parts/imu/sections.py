"""Keys of a rig file for IMU blocks."""

from typing import Literal

from pydantic import Field

from groundstation.declarations.rig_file import RigFile
from groundstation.declarations.section import Delay, NonNegative, Positive, Section

WAKING_S = 0.004
"""Until a process that waits for bytes runs, on a quiet machine."""


class ImuSection(Section):
    """The IMU block: its line, its place and the white noise of its sensors as densities.

    ``averaging`` is in polls of 1 kHz per frame: version 2 is asked for it, version 1 must have it.
    ``temperature_c`` is the operator's reading, for blocks that send none (version 1). ``calibration``
    names results of ``calibrate`` (joint, imu, tilt, gyro-scale, temperature): the filter starts from them.
    """

    baud: Literal[115200, 250000] = 250000
    protocol: Literal["auto", "v1", "v2"] = "auto"
    averaging: int = Field(default=10, ge=1, le=250)
    ftdi_latency_s: Delay = 0.016
    temperature_c: float | None = None
    position_body_m: tuple[float, float] = (0.0, 0.0)
    position_sigma_m: NonNegative = 0.001
    gyro_density_rad_s_rthz: Positive
    acc_density_m_s2_rthz: Positive
    gyro_tempco_rad_s_k: NonNegative = 0.00035
    acc_tempco_m_s2_k: NonNegative = 0.0003
    gyro_bandwidth_hz: NonNegative = 0.0
    acc_bandwidth_hz: NonNegative = 0.0
    calibration: tuple[RigFile, ...] = ()

    @property
    def usual_spread_s(self) -> float:
        """By how much the lateness of samples varies on a quiet machine."""
        return self.ftdi_latency_s + WAKING_S


class ImuOfType(Section):
    """Keys of a type of mock-up."""

    imu: ImuSection


class ImuOfVehicle(Section):
    """Keys of a vehicle: where its block is opened, and which block it must be."""

    imu: str
    imu_serial_number: int | None = Field(default=None, ge=0, le=0xFFFFFFFF)
