"""Data with truth for the fusion tests, made by the laboratory in tools/fusion_truth.py."""

import importlib
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from groundstation.fusion.noise import NoiseModel, packet_density

ROOT = Path(__file__).parents[4]


@cache
def _laboratory() -> ModuleType:
    tools = str(ROOT / "tools")
    sys.path.insert(0, tools)  # its parts import each other by name
    try:
        return importlib.import_module("fusion_truth")
    finally:
        sys.path.remove(tools)


@pytest.fixture(scope="session")
def fusion_truth() -> ModuleType:
    return _laboratory()


@pytest.fixture(scope="session")
def make_folder(tmp_path_factory):
    """Write a data set once per settings and return its folder."""
    made = {}

    def make(**settings) -> Path:
        key = tuple(sorted(settings.items()))
        if key not in made:
            laboratory = _laboratory()
            made[key] = tmp_path_factory.mktemp("fusion")
            laboratory.write(laboratory.make(laboratory.Laboratory(**settings)), made[key])
        return made[key]

    return make


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
def fix_cov(noise: NoiseModel) -> np.ndarray:
    return np.diag([noise.star_sigma_xy_m**2] * 2 + [noise.star_sigma_heading_rad**2])
