"""What a rig states to the estimators: noise, floor of the fixes, table map and calibrated constants."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

from groundstation.declarations.fix import Floor
from groundstation.declarations.rig import Rig
from groundstation.declarations.rig_file import RigFile
from groundstation.files.errors import FileError
from groundstation.fusion.constants import noise_with_constants
from groundstation.fusion.constants_file import parse_constants, surest
from groundstation.fusion.noise import NoiseModel, lag_of_bandwidth
from groundstation.fusion.slope_grid import noise_with
from groundstation.parts.fusion.sections import fused_sources
from groundstation.parts.imu.sections import ImuOfType
from groundstation.parts.stars.sections import StarsOfType

UNSEEN_SHARE = 0.15
"""What the valves' commands leave unknown of a pair's thrust: delays, pressure, what else pulls."""
PULSE_S = 0.1
"""How long such an error lasts."""


def noise_of(rig: Rig, vehicle: str) -> NoiseModel:
    """Return the error model of a vehicle: the rig's figures, and what its calibration files know better.

    Raises:
        ValueError: A calibration file is missing or wrong.
    """
    noise = rig_noise(rig, vehicle)
    grid = rig.table.slope_grid()
    return noise if grid is None else noise_with(noise, grid)


def rig_noise(rig: Rig, vehicle: str) -> NoiseModel:
    """Return the same without the table map, for flights that a map is learned from.

    Raises:
        ValueError: A calibration file of the IMU is missing or wrong.
    """
    mock_up, table = rig.type_of(vehicle), rig.table
    thrust_n = mock_up.valves.thrust_n
    imu, camera = rig.of_type(vehicle, ImuOfType).imu, rig.of_type(vehicle, StarsOfType).star_camera
    noise = NoiseModel(
        packet_period_s=imu.averaging * 1e-3,
        gyro_density_rad_s_rthz=imu.gyro_density_rad_s_rthz,
        acc_density_m_s2_rthz=imu.acc_density_m_s2_rthz,
        star_sigma_xy_m=camera.sigma_xy_m if camera is not None else 0.001,
        star_sigma_heading_rad=camera.sigma_heading_rad if camera is not None else math.radians(0.05),
        fix_delay_sigma_s=camera.delay[1] if camera is not None else 0.0,
        imu_offset_x_m=imu.position_body_m[0],
        imu_offset_y_m=imu.position_body_m[1],
        imu_offset_sigma_m=imu.position_sigma_m,
        gyro_tempco_rad_s_c=imu.gyro_tempco_rad_s_k,
        acc_tempco_m_s2_c=imu.acc_tempco_m_s2_k,
        gyro_lag_s=lag_of_bandwidth(imu.gyro_bandwidth_hz),
        acc_lag_s=lag_of_bandwidth(imu.acc_bandwidth_hz),
    )
    noise = replace(
        noise,
        slope_sigma_m_s2=table.slope_sigma_m_s2 or noise.slope_sigma_m_s2,
        waviness_sigma_m_s2=table.waviness_sigma_m_s2 or noise.waviness_sigma_m_s2,
        waviness_length_m=table.waviness_length_m or noise.waviness_length_m,
        unseen_force_m_s2_rthz=UNSEEN_SHARE * 2.0 * thrust_n / mock_up.mass_kg * PULSE_S**0.5,
    )
    if not imu.calibration:
        return noise
    try:
        found = surest(file.value(parse_constants) for file in imu.calibration)
    except FileError as error:
        raise ValueError(f"mock_ups.{rig.vehicles[vehicle].mock_up}.imu.calibration: {error}") from error
    return noise_with_constants(noise, found)


def floors_of(rig: Rig, vehicle: str) -> dict[str, Floor]:
    """Return what calibration leaves in every fix, m and rad, for each source whose fixes are taken."""
    sources = rig.tables.fix_sources
    return {name: sources[name].floor(rig, vehicle) for name in fused_sources(rig, vehicle)}


def calibration_files(rig: Rig, vehicle: str) -> Iterator[tuple[str, RigFile]]:
    """Yield every calibration file of a vehicle's estimator by its key in the rig."""
    if rig.table.map is not None:
        yield "table.map", rig.table.map
    for number, file in enumerate(rig.of_type(vehicle, ImuOfType).imu.calibration):
        yield f"mock_ups.{rig.vehicles[vehicle].mock_up}.imu.calibration.{number}", file


def calibration_texts(rig: Rig, vehicle: str) -> dict[str, tuple[str, str]]:
    """Return hash and text of the files that a vehicle's estimator is made from, by their names in the rig.

    Raises:
        ValueError: A file is no text.
    """
    return {name: (file.sha256, file.text()) for name, file in calibration_files(rig, vehicle)}
