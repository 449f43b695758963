"""The IMU block as a device of a mock-up: its section of the rig, its own errors, and how it is built."""

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from drivers.imu_block.protocol import V1_WIRE_BYTES, V2_WIRE_BYTES
from drivers.laboratory import ChannelKind
from firmware_emulator.device_kind import DeviceKind
from firmware_emulator.devices.imu_block import ImuBlock
from firmware_emulator.devices.imu_sensors import ImuSensors
from firmware_emulator.devices.sensor_errors import SensorErrors, WarmUp, noise_figures
from firmware_emulator.devices.serial_line import ACTUAL_BAUD, BITS_PER_BYTE, SerialLine
from firmware_emulator.scenario import MockUp
from firmware_emulator.settings import NonNegative, Pair, Positive, Settings

_GYRO_TEMPCO_RAD_S_K = (math.radians(0.02), 0.3)  # typical size, relative spread from block to block
_ACC_TEMPCO_M_S2_K = (3e-4, 0.3)  # 0.002 deg/K
_GYRO_SCALE_SD, _ACC_SCALE_SD, _ACC_CROSS_SD = 0.003, 0.002, 0.003
_GYRO_SCALE_TEMPCO_SD_PER_K = 1e-4
_IMBALANCE_SD_COUNTS = 4.0


class ImuConfig(Settings):
    """The IMU block: its sensors' errors, its firmware's settings and its line."""

    model: Literal["published", "datasheet"] = "published"
    """Noise of the published experiment, or of the data sheets (22 times the gyro noise)."""
    gyro_noise_rad_s: NonNegative | None = None
    """Standard deviation of one poll before rounding; the model's if absent."""
    acc_noise_m_s2: NonNegative | None = None
    """Likewise, of the difference of an inclinometer's two channels."""
    frame_version: Literal[1, 2] = 2
    baud: Literal[115200, 250000] = 250000
    """Nominal; the PIC's divider makes 113636 of 115200."""
    averaging: Annotated[int, Field(ge=1, le=100)] = 10
    """Polls per frame: 1000 / averaging frames per second."""
    ftdi_latency_ms: Annotated[int, Field(ge=1, le=255)] = 16
    host_jitter_s: NonNegative = 0.0001
    """Mean of the exponentially distributed time a packet waits for the host."""
    clock_ppm: Annotated[float, Field(ge=-9000.0, le=9000.0)] | None = None
    """The crystal (5000: a ceramic resonator) runs fast by this much; drawn within 50 ppm if absent."""
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


def build(mock_up: MockUp, settings: ImuConfig) -> ImuBlock:
    """The block that a mock-up carries."""
    sensors = ImuSensors(
        _draw_errors(settings, mock_up.random("imu errors")),
        noise_figures(settings.model, settings.gyro_noise_rad_s, settings.acc_noise_m_s2),
        mock_up.random("imu noise"),
        settings.outlier_rate_hz,
    )
    line = SerialLine(
        settings.baud,
        settings.ftdi_latency_ms * 1e-3,
        settings.host_jitter_s,
        mock_up.failures,
        mock_up.random("line"),
        mock_up.start_ns,
    )
    return ImuBlock(
        mock_up.vehicle,
        mock_up.grid,
        sensors,
        line,
        settings.frame_version,
        settings.averaging,
        mock_up.index + 1 if settings.serial_number is None else settings.serial_number,
        WarmUp(settings.ambient_c, settings.warm_up_k, settings.warm_up_s),
        mock_up.failures,
        mock_up.random("housekeeping"),
        mock_up.start_ns,
    )


def _draw_errors(config: ImuConfig, rng: np.random.Generator) -> SensorErrors:
    """This very block: stated values stand, the rest is drawn (always, so that stating shifts nothing)."""
    draws = rng.standard_normal(16).tolist()
    gyro_tempco = _GYRO_TEMPCO_RAD_S_K[0] * (1.0 + _GYRO_TEMPCO_RAD_S_K[1] * draws[2])
    acc_tempco = tuple(_ACC_TEMPCO_M_S2_K[0] * (1.0 + _ACC_TEMPCO_M_S2_K[1] * draw) for draw in draws[3:5])
    gyro_bias = config.gyro_bias_sd_rad_s * draws[0]
    if config.gyro_bias_rad_s is not None:
        gyro_bias = config.gyro_bias_rad_s
    if config.gyro_tempco_rad_s_k is not None:
        gyro_tempco = config.gyro_tempco_rad_s_k
    gyro_scale = _GYRO_SCALE_SD * draws[5] if config.gyro_scale_error is None else config.gyro_scale_error
    acc_scale = config.acc_scale_error or (_ACC_SCALE_SD * draws[6], _ACC_SCALE_SD * draws[7])
    acc_bias = config.acc_bias_m_s2 or (
        config.acc_bias_sd_m_s2 * draws[8],
        config.acc_bias_sd_m_s2 * draws[9],
    )
    return SensorErrors(
        gyro_bias_rad_s=gyro_bias + config.switch_on_sd_rad_s * draws[1],
        gyro_tempco_rad_s_k=gyro_tempco,
        gyro_scale=1.0 + gyro_scale,
        gyro_scale_tempco_per_k=_GYRO_SCALE_TEMPCO_SD_PER_K * draws[10],
        gyro_walk_rad_s_sqrt_s=config.bias_walk_rad_s_sqrt_s,
        acc_bias_m_s2=acc_bias,
        acc_tempco_m_s2_k=config.acc_tempco_m_s2_k or (acc_tempco[0], acc_tempco[1]),
        acc_scale=(1.0 + acc_scale[0], 1.0 + acc_scale[1]),
        acc_cross=(_ACC_CROSS_SD * draws[11], _ACC_CROSS_SD * draws[12]),
        imbalance_counts=(_IMBALANCE_SD_COUNTS * draws[13], _IMBALANCE_SD_COUNTS * draws[14]),
    )


IMU = DeviceKind(
    name="imu",
    channel=ChannelKind.BYTES,
    per_vehicle=build,
    section="imu",
    settings=ImuConfig,
    is_standard=True,
    accepts=bytes,
    served_by="firmware_emulator.live.pty_port:PtyServed",
)
