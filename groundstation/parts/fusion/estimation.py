"""What a rig says to the estimators: noise, floor of the fixes, table map and calibrated constants."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from groundstation.fusion.constants import noise_with_constants
from groundstation.fusion.constants_file import ConstantsError, read_constants
from groundstation.fusion.noise import NoiseModel, lag_of_bandwidth
from groundstation.fusion.slope_grid import SlopeGrid, noise_with
from groundstation.fusion.table_map import TableMap, TableMapError
from groundstation.runtime.errors import RigError
from groundstation.runtime.rig import Rig

UNSEEN_SHARE = 0.15
"""What the valves' commands leave unknown of a pair's thrust: delays, pressure, what else pulls."""
PULSE_S = 0.1
"""How long such an error lasts."""


def noise_of(rig: Rig, vehicle: str) -> NoiseModel:
    """Return the error model of a vehicle: the rig's figures, and what its calibration files know better.

    Raises:
        RigError: A calibration file is missing or wrong.
    """
    noise = rig_noise(rig, vehicle)
    grid = slope_grid_of(rig)
    return noise if grid is None else noise_with(noise, grid)


def rig_noise(rig: Rig, vehicle: str) -> NoiseModel:
    """Return the same without the table map, for flights that a map is learned from.

    Raises:
        RigError: A calibration file of the IMU is missing or wrong.
    """
    mock_up, table = rig.mock_up_of(vehicle), rig.table
    thrust_n = mock_up.valves.thrust_n
    imu, camera = mock_up.imu, mock_up.star_camera
    noise = NoiseModel(
        packet_period_s=imu.averaging * 1e-3,
        gyro_density_rad_s_rthz=imu.gyro_density_rad_s_rthz,
        acc_density_m_s2_rthz=imu.acc_density_m_s2_rthz,
        star_sigma_xy_m=camera.sigma_xy_m if camera is not None else 0.001,
        star_sigma_heading_rad=camera.sigma_heading_rad if camera is not None else math.radians(0.05),
        fix_delay_sigma_s=camera.delay_sigma_s if camera is not None else 0.0,
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
        found = read_constants(imu.calibration)
    except ConstantsError as error:
        raise RigError(f"mock_ups.{rig.vehicles[vehicle].mock_up}.imu.calibration: {error}") from error
    return noise_with_constants(noise, found)


def fix_floor_of(rig: Rig, vehicle: str) -> tuple[float, float]:
    """Return what calibration leaves in every fix, m and rad; an external pose stream says it itself."""
    camera = rig.mock_up_of(vehicle).star_camera
    if rig.vehicles[vehicle].fixes is not None or camera is None:
        return 0.0, 0.0
    return camera.sigma_xy_m, camera.sigma_heading_rad


def fix_floors_of(rig: Rig, vehicle: str) -> dict[str, tuple[float, float]]:
    """Return what calibration leaves in every fix, m and rad, for each source that the vehicle has."""
    floors = {}
    if rig.vehicles[vehicle].has_stars:
        floors["stars"] = fix_floor_of(rig, vehicle)
    if rig.overhead_camera is not None:
        floors["overhead"] = rig.overhead_camera.sigma_xy_m, rig.overhead_camera.sigma_heading_rad
    return floors


def fused_floors_of(rig: Rig, vehicle: str) -> dict[str, tuple[float, float]]:
    """Return the same for the sources whose fixes the vehicle's estimator takes."""
    floors = fix_floors_of(rig, vehicle)
    return {source: floors[source] for source in rig.vehicles[vehicle].fused}


def slope_grid_of(rig: Rig) -> SlopeGrid | None:
    """Return the rig's table map for filter and controller, None if it names none.

    Raises:
        RigError: The map is missing or wrong.
    """
    if rig.table.map is None:
        return None
    try:
        return slope_grid(TableMap.load(rig.table.map))
    except TableMapError as error:
        raise RigError(f"table.map: {error}") from error


def slope_grid(found: TableMap) -> SlopeGrid:
    """Return a map as filters and controllers read it."""
    std = np.sqrt(0.5 * (found.std_x_m_s2**2 + found.std_y_m_s2**2))
    return SlopeGrid(
        found.x_min_m, found.y_min_m, found.step_m, found.ax_m_s2, found.ay_m_s2, std, found.mean_m_s2
    )


def calibration_files(rig: Rig) -> Iterator[tuple[str, Path]]:
    """Yield every calibration file of the estimators by the name that the rig gives it."""
    if rig.table.map is not None:
        yield "table.map", rig.table.map
    for name, mock_up in rig.mock_ups.items():
        for number, path in enumerate(mock_up.imu.calibration):
            yield f"{name}.imu.calibration.{number}", path


def calibration_texts(rig: Rig, vehicle: str) -> dict[str, tuple[str, str]]:
    """Return hash and text of the files that a vehicle's estimator is made from, by their names in the rig.

    Raises:
        RigError: A file cannot be read.
    """
    own = f"{rig.vehicles[vehicle].mock_up}.imu.calibration."
    texts = {}
    for name, path in calibration_files(rig):
        if name == "table.map" or name.startswith(own):
            try:
                data = path.read_bytes()
                texts[name] = hashlib.sha256(data).hexdigest(), data.decode()
            except (OSError, UnicodeDecodeError) as error:
                raise RigError(f"{name}: {path} cannot be read ({error})") from error
    return texts
