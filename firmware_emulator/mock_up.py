"""One mock-up put together from its configuration: body, valves, IMU block, camera, truth."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from firmware_emulator.config import TableConfig
from firmware_emulator.devices.imu_block import GYRO_START_NS, ImuBlock
from firmware_emulator.devices.imu_sensors import ImuSensors
from firmware_emulator.devices.pose_streams import FixErrors, FixStream, TruthStream
from firmware_emulator.devices.sensor_errors import SensorErrors, WarmUp, noise_figures
from firmware_emulator.devices.serial_line import SerialLine
from firmware_emulator.devices.star_camera import StarCamera
from firmware_emulator.devices.valve_node import ValveNode
from firmware_emulator.failures import Failures
from firmware_emulator.mock_up_config import CameraConfig, ImuConfig, VehicleConfig
from firmware_emulator.plant.air_table import FloorPulses, Surface
from firmware_emulator.plant.body import Body
from firmware_emulator.plant.motion_state import Motion, PollGrid
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import GasSupply, Nozzle, ThrusterBank, ValveTiming

Random = Callable[[str], np.random.Generator]
"""A generator of its own for each named part: one part's draws never shift another's."""

_CLOCK_PPM = 50.0  # tolerance of a cheap crystal
_GYRO_TEMPCO_RAD_S_K = (math.radians(0.02), 0.3)  # typical size, relative spread from block to block
_ACC_TEMPCO_M_S2_K = (3e-4, 0.3)  # 0.002 deg/K
_GYRO_SCALE_SD, _ACC_SCALE_SD, _ACC_CROSS_SD = 0.003, 0.002, 0.003
_GYRO_SCALE_TEMPCO_SD_PER_K = 1e-4
_IMBALANCE_SD_COUNTS = 4.0


@dataclass(frozen=True, slots=True)
class MockUp:
    """A vehicle and the devices it carries."""

    name: str
    vehicle: Vehicle
    imu: ImuBlock
    node: ValveNode
    camera: StarCamera | None
    fixes: FixStream | None
    truth: TruthStream | None


def build_mock_up(
    index: int,
    config: VehicleConfig,
    table: TableConfig,
    surface: Surface,
    floor: FloorPulses,
    failures: Failures,
    random: Random,
    start_ns: int,
) -> MockUp:
    """Put a mock-up together.

    Args:
        index: Its place in the scenario, and on the valve bus.
        config: Its table of the rig.
        table: For friction and bounds.
        surface: The table's surface, shared by all.
        floor: The floor's shocks, shared by all.
        failures: Those that befall it.
        random: Its random numbers.
        start_ns: Power-up.
    """
    imu = config.imu
    crystal = random("crystal")
    drawn_ppm, phase = crystal.uniform(-_CLOCK_PPM, _CLOCK_PPM), crystal.uniform(0.0, 1e6)
    ppm = drawn_ppm if imu.clock_ppm is None else imu.clock_ppm
    grid = PollGrid(start_ns + GYRO_START_NS + round(phase), ppm)
    vehicle = _build_vehicle(config, table, surface, floor, grid, random("valves"), start_ns)
    camera, fixes = _build_camera(index, config.camera, table, vehicle, failures, random, start_ns)
    truth = None
    if config.reference_rate_hz > 0.0:
        truth = TruthStream(index, vehicle, config.reference_rate_hz, config.reference_delay_s, start_ns)
    node = ValveNode(
        index,
        vehicle,
        config.valves.minimum_on_ms,
        config.float_delay_s,
        failures,
        random("node"),
        start_ns,
    )
    block = _build_imu(index, imu, vehicle, grid, failures, random, start_ns)
    return MockUp(config.name, vehicle, block, node, camera, fixes, truth)


def _build_vehicle(
    config: VehicleConfig,
    table: TableConfig,
    surface: Surface,
    floor: FloorPulses,
    grid: PollGrid,
    rng: np.random.Generator,
    start_ns: int,
) -> Vehicle:
    valves = config.valves
    spread = 1.0 + valves.spread * rng.uniform(-1.0, 1.0, len(config.thrusters))
    nozzles = [
        Nozzle(nozzle.position_body_m, nozzle.direction_body, nozzle.thrust_n * float(factor))
        for nozzle, factor in zip(config.thrusters, spread, strict=True)
    ]
    thrusters = ThrusterBank(
        nozzles,
        config.centre_of_mass_body_m,
        ValveTiming(
            valves.open_delay_s, valves.open_delay_sd_s, valves.close_delay_s, valves.rise_s, valves.sag
        ),
        GasSupply(valves.tank_pa, valves.supply_pa, valves.tank_impulse_n_s),
        rng,
    )
    body = Body(
        config.mass_kg,
        config.inertia_kg_m2,
        config.centre_of_mass_body_m,
        config.imu.position_body_m,
        config.radius_m,
        config.drag_n_s_m,
        config.drag_nm_s,
    )
    origin = Motion(
        *config.start_m,
        math.radians(config.start_heading_deg),
        *config.start_velocity_m_s,
        math.radians(config.start_rate_deg_s),
    )
    return Vehicle(
        body, origin, thrusters, surface, floor, table.friction_landed, config.floating, grid, start_ns
    )


def _build_imu(
    index: int,
    config: ImuConfig,
    vehicle: Vehicle,
    grid: PollGrid,
    failures: Failures,
    random: Random,
    start_ns: int,
) -> ImuBlock:
    sensors = ImuSensors(
        _draw_errors(config, random("imu errors")),
        noise_figures(config.model),
        random("imu noise"),
        config.outlier_rate_hz,
    )
    line = SerialLine(
        config.baud, config.ftdi_latency_ms * 1e-3, config.host_jitter_s, failures, random("line"), start_ns
    )
    return ImuBlock(
        vehicle,
        grid,
        sensors,
        line,
        config.frame_version,
        config.averaging,
        index + 1 if config.serial_number is None else config.serial_number,
        WarmUp(config.ambient_c, config.warm_up_k, config.warm_up_s),
        failures,
        random("housekeeping"),
        start_ns,
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


def _build_camera(
    index: int,
    config: CameraConfig,
    table: TableConfig,
    vehicle: Vehicle,
    failures: Failures,
    random: Random,
    start_ns: int,
) -> tuple[StarCamera | None, FixStream | None]:
    rng = random("camera")
    if config.source == "rendered":
        camera = StarCamera(
            vehicle,
            config.rate_hz,
            config.exposure_s,
            config.readout_s,
            config.delay_s,
            config.delay_jitter_s,
            failures,
            rng,
            start_ns,
        )
        return camera, None
    if config.source == "none":
        return None, None
    errors = FixErrors(
        config.sigma_xy_m,
        config.sigma_heading_rad,
        config.missing_fraction,
        config.wrong_fraction,
        table.bounds_m,
    )
    fixes = FixStream(
        index,
        vehicle,
        config.rate_hz,
        config.delay_s,
        config.delay_jitter_s,
        errors,
        failures,
        rng,
        start_ns,
    )
    return None, fixes
