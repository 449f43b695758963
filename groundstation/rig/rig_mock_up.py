"""What the rig file says of a kind of mock-up: valves, IMU, star camera, estimator, controller.

Unknown keys are refused. Lengths are metres; relative paths are relative to the rig file.
"""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from groundstation.control.registry import CONTROLLERS
from groundstation.fusion.registry import ESTIMATORS
from groundstation.star_tracking.stamp_delay import read_delay

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]


class Section(BaseModel):
    """A table of the rig file: unknown keys, infinities and NaN are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ValvesSection(Section):
    """The default layout of eight valves, two per side at plus and minus ``arm_m``."""

    thrust_n: Positive = 0.22
    arm_m: Positive = 0.15
    min_on_s: Positive = 0.010
    open_delay_s: NonNegative = 0.006
    close_delay_s: NonNegative = 0.005
    rise_s: NonNegative = 0.004
    period_s: Positive = 0.1
    max_open_s: Positive = 2.0


class ImuSection(Section):
    """The IMU block: its line, its place and the white noise of its sensors as densities.

    ``averaging`` is in polls of 1 kHz per frame: version 2 is asked for it, version 1 must have it.
    ``temperature_c`` is the operator's reading, for blocks that send none (version 1). ``calibration``
    names results of ``calibrate`` (joint, imu, tilt, gyro-scale, temperature): the filter starts from them.
    """

    baud: Literal[115200, 250000] = 250000
    protocol: Literal["auto", "v1", "v2"] = "auto"
    averaging: int = Field(default=10, ge=1, le=250)
    ftdi_latency_s: NonNegative = 0.016
    temperature_c: float | None = None
    position_body_m: tuple[float, float] = (0.0, 0.0)
    position_sigma_m: NonNegative = 0.001
    gyro_density_rad_s_rthz: Positive
    acc_density_m_s2_rthz: Positive
    gyro_tempco_rad_s_k: NonNegative = 0.00035
    acc_tempco_m_s2_k: NonNegative = 0.0003
    gyro_bandwidth_hz: NonNegative = 0.0
    acc_bandwidth_hz: NonNegative = 0.0
    calibration: tuple[Path, ...] = ()


class StarCameraSection(Section):
    """The star camera: calibration files, delay from exposure to arrival, floor of its errors.

    ``delay_file`` is what `star-tracker delay` wrote; it stands for ``delay_s`` and ``delay_sigma_s``.
    """

    camera: Path
    ceiling: Path
    delay_s: NonNegative = 0.0
    delay_sigma_s: NonNegative = 0.002
    delay_file: Path | None = None
    timeout_s: Positive = 2.0
    exposure_s: NonNegative = 0.0
    readout_s: NonNegative = 0.0
    sigma_xy_m: Positive = 0.001
    sigma_heading_rad: Positive = 0.0009

    @model_validator(mode="after")
    def _one_delay(self) -> Self:
        if self.delay_file is not None and self.model_fields_set & {"delay_s", "delay_sigma_s"}:
            raise ValueError("give either 'delay_file' or 'delay_s' and 'delay_sigma_s'")
        return self

    def anchored(self, folder: Path) -> Self:
        """The same with paths relative to a folder, and the delay of its file.

        Raises:
            CalibrationFileError: The delay's file is missing or wrong.
        """
        update: dict[str, Any] = {"camera": folder / self.camera, "ceiling": folder / self.ceiling}
        if self.delay_file is not None:
            update["delay_file"] = folder / self.delay_file
            found = read_delay(update["delay_file"])
            update |= {"delay_s": found.delay_s, "delay_sigma_s": found.sigma_s}
        return self.model_copy(update=update)


class FusionSection(Section):
    """Which estimator, and how long the rest at the start must be."""

    method: str = "filter"
    rest_s: Positive = 8.0

    @model_validator(mode="after")
    def _known(self) -> Self:
        if self.method not in ESTIMATORS:
            raise ValueError(f"method {self.method!r} is none of {', '.join(sorted(ESTIMATORS))}")
        return self


class ControlSection(Section):
    """Which controller flies the mock-up, and its parameters as that controller defines them."""

    controller: str = "station"
    parameters: dict[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _known(self) -> Self:
        if self.controller not in CONTROLLERS:
            raise ValueError(f"controller {self.controller!r} is none of {', '.join(sorted(CONTROLLERS))}")
        return self


class MockUpSection(Section):
    """A type of mock-up; vehicles name one."""

    mass_kg: Positive = 11.0
    inertia_kg_m2: Positive = 0.25
    valves: ValvesSection = ValvesSection()
    imu: ImuSection
    star_camera: StarCameraSection | None = None
    fusion: FusionSection = FusionSection()
    control: ControlSection = ControlSection()
