"""One mock-up put together from its configuration: body, valves, and the clock by which it is felt."""

import math

import numpy as np

from firmware_emulator.config import TableConfig
from firmware_emulator.devices.imu import IMU, ImuConfig
from firmware_emulator.devices.imu_block import GYRO_START_NS
from firmware_emulator.failures import Failures
from firmware_emulator.mock_up_config import VehicleConfig
from firmware_emulator.plant.air_table import FloorPulses, Surface
from firmware_emulator.plant.body import Body
from firmware_emulator.plant.motion_state import Motion, PollGrid
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import GasSupply, Nozzle, ThrusterBank, ValveTiming
from firmware_emulator.scenario import MockUp, Scenario

_CLOCK_PPM = 50.0  # tolerance of a cheap crystal


def build_table(scenario: Scenario) -> tuple[Surface, FloorPulses]:
    """The surface that all mock-ups share, and the shocks of the floor under it."""
    table = scenario.config.table
    rng = scenario.random("surface")
    surface = Surface(table.tilt_rad, table.waviness_rad, table.waviness_length_m, rng)
    return surface, FloorPulses(table.floor_pulse_rate_hz, table.floor_pulse_m_s2, table.floor_pulse_s, rng)


def build_mock_ups(scenario: Scenario, surface: Surface, floor: FloorPulses) -> tuple[MockUp, ...]:
    """Put every mock-up of a scenario on the table."""
    return tuple(
        _build_mock_up(scenario, index, surface, floor) for index in range(len(scenario.config.vehicles))
    )


def _build_mock_up(scenario: Scenario, index: int, surface: Surface, floor: FloorPulses) -> MockUp:
    config = scenario.config.vehicles[index]
    imu = IMU.settings_in(config) or ImuConfig()
    crystal = scenario.random_of_vehicle(index, "crystal")
    drawn_ppm, phase = crystal.uniform(-_CLOCK_PPM, _CLOCK_PPM), crystal.uniform(0.0, 1e6)
    ppm = drawn_ppm if imu.clock_ppm is None else imu.clock_ppm
    grid = PollGrid(scenario.start_ns + GYRO_START_NS + round(phase), ppm)
    vehicle = _build_vehicle(
        config,
        imu.position_body_m,
        scenario.config.table,
        surface,
        floor,
        grid,
        scenario.random_of_vehicle(index, "valves"),
        scenario.start_ns,
    )
    failures = Failures.of_vehicle(scenario.config.failures, config.name)
    failures.watch("body", lambda now_ns: _push(vehicle, failures, now_ns, scenario.start_ns))
    return MockUp(index, config, vehicle, grid, failures, scenario)


def _push(vehicle: Vehicle, failures: Failures, now_ns: int, start_ns: int) -> None:
    """Let all hands push that do so at `now_ns`."""
    hands = failures.all_active("pushed", now_ns - start_ns)
    force_x_n, force_y_n, torque_nm = (
        sum(hand.parameters[name] for hand in hands) for name in ("force_x_n", "force_y_n", "torque_nm")
    )
    vehicle.advance(now_ns)
    vehicle.set_hand(force_x_n, force_y_n, torque_nm)


def _build_vehicle(
    config: VehicleConfig,
    imu_body_m: tuple[float, float],
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
        imu_body_m,
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
