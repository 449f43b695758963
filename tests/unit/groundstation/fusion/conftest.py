"""A noise model and a covariance for the fusion tests."""

import numpy as np
import pytest

from groundstation.fusion.noise import NoiseModel, packet_density


@pytest.fixture
def noise() -> NoiseModel:
    """The published condition at 100 packets/s."""
    return NoiseModel(
        packet_period_s=0.01,
        gyro_density_rad_s_rthz=packet_density(1.75e-3, 4.26e-3, 1000.0),
        acc_density_m_s2_rthz=packet_density(2e-3, 1.25e-3, 1000.0),
        star_sigma_xy_m=1e-3,
        star_sigma_heading_rad=8.7e-4,
        imu_offset_x_m=0.0315,
        imu_offset_y_m=-0.0212,
    )


@pytest.fixture
def fix_covariance(noise: NoiseModel) -> np.ndarray:
    return np.diag([noise.star_sigma_xy_m**2] * 2 + [noise.star_sigma_heading_rad**2])
