"""One mock-up of the scenario: body, valves, IMU block, camera."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from drivers.imu_block.protocol import V1_WIRE_BYTES, V2_WIRE_BYTES
from drivers.valve_bus.protocol import VALVES
from firmware_emulator.devices.serial_line import ACTUAL_BAUD, BITS_PER_BYTE
from firmware_emulator.settings import Fraction, NonNegative, Pair, Positive, Settings


class ThrusterConfig(Settings):
    """One valve and its nozzle."""

    position_body_m: Pair
    direction_body: Pair
    """Direction of the force on the vehicle (opposite to the gas), normalised on use."""
    thrust_n: Positive = 0.22

    @model_validator(mode="after")
    def _direction_points_somewhere(self) -> "ThrusterConfig":
        if self.direction_body == (0.0, 0.0):
            raise ValueError("direction_body must not be zero")
        return self


def _pairs_on_each_side() -> tuple[ThrusterConfig, ...]:
    arm_m = 0.15
    return tuple(
        ThrusterConfig(position_body_m=position, direction_body=direction)
        for direction, places in (
            ((1.0, 0.0), ((-arm_m, arm_m), (-arm_m, -arm_m))),
            ((-1.0, 0.0), ((arm_m, arm_m), (arm_m, -arm_m))),
            ((0.0, 1.0), ((arm_m, -arm_m), (-arm_m, -arm_m))),
            ((0.0, -1.0), ((arm_m, arm_m), (-arm_m, arm_m))),
        )
        for position in places
    )


class ValveConfig(Settings):
    """Cold-gas supply and valves, defaults as for fast miniature valves on laboratory mock-ups."""

    open_delay_s: NonNegative = 0.006
    open_delay_sd_s: NonNegative = 0.0005
    """From pulse to pulse."""
    close_delay_s: NonNegative = 0.005
    rise_s: Positive = 0.004
    """Time constant of thrust build-up and decay."""
    minimum_on_ms: Annotated[int, Field(ge=0, le=127)] = 10
    """The node refuses shorter pulses: the poppet would not lift reliably."""
    spread: Fraction = 0.05
    """Thrust of each valve differs from nominal by up to this fraction, drawn once."""
    sag: Annotated[float, Field(gt=0.0, le=1.0)] = 0.97
    """Thrust factor per further open valve (SPHERES guest code models its supply so)."""
    tank_pa: Positive = 20e6
    supply_pa: Positive = 0.6e6
    """Set point of the regulator."""
    tank_impulse_n_s: Positive = 300.0
    """What a full tank can give; 1 l of air at 200 bar and 50 s of specific impulse gives about 120 N s."""


class ImuConfig(Settings):
    """The IMU block: its sensors' errors, its firmware's settings and its line."""

    model: Literal["published", "datasheet"] = "published"
    """Noise of the published experiment, or of the data sheets (22 times the gyro noise)."""
    frame_version: Literal[1, 2] = 2
    baud: Literal[115200, 250000] = 250000
    """Nominal; the PIC's divider makes 113636 of 115200."""
    averaging: Annotated[int, Field(ge=1, le=100)] = 10
    """Polls per frame: 1000 / averaging frames per second."""
    ftdi_latency_ms: Annotated[int, Field(ge=1, le=255)] = 16
    host_jitter_s: NonNegative = 0.0001
    """Mean of the exponentially distributed time a packet waits for the host."""
    clock_ppm: Annotated[float, Field(ge=-500.0, le=500.0)] | None = None
    """The crystal runs fast by this much; drawn within 50 ppm if absent."""
    position_body_m: Pair = (0.03151, -0.02122)
    serial_number: Annotated[int, Field(ge=0, le=65535)] | None = None
    """Default 1 + the vehicle's index."""
    gyro_bias_rad_s: float | None = None
    """Null error at 25 deg C; drawn if absent."""
    gyro_bias_sd_rad_s: NonNegative = 0.0087
    switch_on_sd_rad_s: NonNegative = 0.0005
    """Part of the null that is new at each start."""
    gyro_tempco_rad_s_k: float | None = None
    gyro_scale_error: Annotated[float, Field(gt=-0.2, lt=0.2)] | None = None
    bias_walk_rad_s_sqrt_s: NonNegative = 2e-6
    acc_bias_m_s2: Pair | None = None
    acc_bias_sd_m_s2: NonNegative = 0.03
    """A block that is screwed on 0.2 degrees off level reads 0.03."""
    acc_tempco_m_s2_k: Pair | None = None
    acc_scale_error: Pair | None = None
    outlier_rate_hz: NonNegative = 0.0
    """Rate of polls that read garbage from a sensor."""
    ambient_c: float = 22.0
    warm_up_k: float = 4.0
    """Rise of the block's own temperature after switch-on."""
    warm_up_s: Positive = 300.0

    @model_validator(mode="after")
    def _line_carries_the_frames(self) -> "ImuConfig":
        frame_bytes = V2_WIRE_BYTES if self.frame_version == 2 else V1_WIRE_BYTES
        if 1000.0 / self.averaging * frame_bytes * BITS_PER_BYTE > ACTUAL_BAUD[self.baud]:
            raise ValueError(
                f"averaging = {self.averaging} makes {1000 / self.averaging:.0f} frames/s, "
                f"more than {self.baud} Bd carry"
            )
        return self


class CameraConfig(Settings):
    """The webcam that looks up, or fixes drawn in its place."""

    source: Literal["rendered", "fixes", "none"] = "fixes"
    """Pictures, or poses drawn from truth plus noise on the channel `<vehicle>/fixes`, or nothing."""
    rate_hz: Positive = 1.5
    exposure_s: Positive = 0.02
    readout_s: NonNegative = 0.0
    """Rolling shutter: time between the exposures of first and last row."""
    delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.6
    """From the middle of the exposure to the host; a drawn fix can say ages up to 4.29 s."""
    delay_jitter_s: NonNegative = 0.002
    sigma_xy_m: NonNegative = 0.001
    sigma_heading_rad: NonNegative = 0.00087
    missing_fraction: Fraction = 0.0
    """Of the exposures, how many give no drawn fix."""
    wrong_fraction: Fraction = 0.0
    """Of the drawn fixes, how many are wrong by more than their sigma says, unmarked."""
    stream: Literal["raw", "mjpeg"] = "raw"
    """How live pictures are served over HTTP."""
    jpeg_quality: Annotated[int, Field(ge=1, le=100)] = 90
    ceiling: str = ""
    """Path of the star list (id,x_m,y_m); needed by `rendered`."""
    camera: str = ""
    """Path of the camera file (JSON); needed by `rendered`."""

    @model_validator(mode="after")
    def _exposure_fits_the_rate(self) -> "CameraConfig":
        if self.source == "rendered" and (self.exposure_s + self.readout_s) * self.rate_hz >= 1.0:
            raise ValueError(
                f"exposure_s + readout_s = {self.exposure_s + self.readout_s:g} s is longer than a period of "
                f"rate_hz = {self.rate_hz:g}"
            )
        return self

    @model_validator(mode="after")
    def _rendering_has_its_files(self) -> "CameraConfig":
        if self.source == "rendered" and not (self.ceiling and self.camera):
            raise ValueError("source = 'rendered' needs both ceiling and camera, the paths of their files")
        return self


class VehicleConfig(Settings):
    """One mock-up."""

    name: Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$")]
    mass_kg: Positive = 11.0
    inertia_kg_m2: Positive = 0.25
    """About the vertical through the centre of mass."""
    centre_of_mass_body_m: Pair = (0.0, 0.0)
    radius_m: Positive = 0.2
    """Of the bumper, around the body's origin."""
    start_m: Pair = (0.0, 0.0)
    """Body origin in the table frame."""
    start_heading_deg: float = 0.0
    start_velocity_m_s: Pair = (0.0, 0.0)
    start_rate_deg_s: float = 0.0
    floating: bool = False
    """Whether float air is on at the start."""
    float_delay_s: NonNegative = 0.2
    """From the command until the bearings lift, or set down."""
    drag_n_s_m: NonNegative = 0.002
    """Air drag in proportion to speed."""
    drag_nm_s: NonNegative = 1e-5
    thrusters: tuple[ThrusterConfig, ...] = Field(default_factory=_pairs_on_each_side)
    valves: ValveConfig = ValveConfig()
    imu: ImuConfig = ImuConfig()
    camera: CameraConfig = CameraConfig()
    reference_rate_hz: NonNegative = 50.0
    """Poses per second of the truth stream; 0 for none."""
    reference_delay_s: Annotated[float, Field(ge=0.0, le=4.0)] = 0.002
    seed_offset: Annotated[int, Field(ge=0)] = 0
    """Added to the seed of this vehicle's random numbers."""

    @model_validator(mode="after")
    def _valves_fit_the_bus(self) -> "VehicleConfig":
        if len(self.thrusters) != VALVES:
            raise ValueError(f"thrusters must be {VALVES}, got {len(self.thrusters)}")
        return self
