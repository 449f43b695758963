"""A noise model, a covariance and data folders for the fusion tests."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.cli.fusion import app
from groundstation.fusion.noise import NoiseModel, packet_density

IMU = "t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C"
STARS = "t_exposure_s,t_arrival_s,x_m,y_m,heading_rad"


class Flight:
    """A data folder as arrays; truth by the rows' true times."""

    def __init__(self, source, folder):
        shutil.copytree(source, folder)
        self.folder = folder
        self.imu = np.loadtxt(folder / "imu.csv", delimiter=",", skiprows=1)
        self.stars = np.loadtxt(folder / "stars.csv", delimiter=",", skiprows=1)
        self.truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
        self.true_s = self.imu[:, 0].copy()

    def run(self, *words):
        for name, header, rows in (("imu", IMU, self.imu), ("stars", STARS, self.stars)):
            np.savetxt(self.folder / f"{name}.csv", rows, "%.9f", ",", header=header, comments="")
        out = self.folder / "estimate.csv"
        result = CliRunner().invoke(app, ["run", str(self.folder), "--out", str(out), *words])
        if result.exception is not None:
            raise result.exception
        self.output = result.output
        rows = np.genfromtxt(out, delimiter=",", skip_header=1)
        want = [np.interp(self.true_s, self.truth["t_s"], self.truth[n]) for n in ("x_m", "y_m")]
        self.error_m = np.hypot(rows[:, 1] - want[0], rows[:, 2] - want[1])
        self.sigma_m = np.hypot(rows[:, 10], rows[:, 11])
        self.heading_sigma_rad = rows[:, 12]
        return self


@pytest.fixture
def make_flight(tmp_path):
    """Copies a data folder for tests that change it."""
    return lambda source: Flight(source, tmp_path / "data")


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
