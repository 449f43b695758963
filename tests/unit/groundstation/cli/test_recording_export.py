"""``groundstation recording export``: a recorded flight becomes a folder that every method reads."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.data_sets.fusion_folder import read_folder
from groundstation.declarations.errors import UsageError
from groundstation.fusion.estimators import ESTIMATORS
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.rig.read import load_rig
from groundstation.watch.recorded_flight import opened, recorded_flight

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "drawn_fixes.toml"


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    path = tmp_path_factory.mktemp("flown") / "run.mcap"
    run_lockstep(load_rig(RIG), RIG.read_text(), RIG, path, 14.0, 3, lambda *_: None)
    return path


def test_the_folder_holds_the_flight(flown, groundstation, tmp_path):
    folder = tmp_path / "flight"
    assert "fixes" in groundstation("recording", "export", flown, "--fusion-folder", folder).stdout
    with opened(flown) as (recording, rig):
        before = recorded_flight(flown, recording, rig, "alpha").tidied()
    after = read_folder(folder)
    np.testing.assert_allclose(after.imu, before.imu, atol=1e-6)
    np.testing.assert_allclose(after.stars, before.stars, atol=1e-6)
    assert after.run_start_s == pytest.approx(before.run_start_s, abs=1e-6)
    assert after.noise.gyro_density_rad_s_rthz == pytest.approx(before.noise.gyro_density_rad_s_rthz)
    assert after.noise.acc_density_m_s2_rthz == pytest.approx(before.noise.acc_density_m_s2_rthz)
    assert after.noise.imu_offset_x_m == before.noise.imu_offset_x_m
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    assert np.interp(13.0, truth["t_s"], truth["x_m"]) == pytest.approx(
        np.interp(13.0, before.reference[:, 0], before.reference[:, 1]), abs=1e-6
    )


def test_every_method_estimates_it_again(flown, groundstation, tmp_path):
    folder = tmp_path / "flight"
    groundstation("recording", "export", flown, "--fusion-folder", folder)
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    for method in ESTIMATORS:
        groundstation("fusion", "run", folder, "--out", tmp_path / "e.csv", "--method", method)
        found = np.genfromtxt(tmp_path / "e.csv", delimiter=",", names=True)
        off_m = np.abs(found["x_m"] - np.interp(found["t_s"], truth["t_s"], truth["x_m"]))
        assert np.nanmax(off_m[found["t_s"] > 6.0]) < 0.1


def test_a_vehicle_that_is_not_there_is_named(flown, groundstation, tmp_path):
    with pytest.raises(UsageError, match="no vehicle 'beta'"):
        groundstation("recording", "export", flown, "--fusion-folder", tmp_path / "f", "--vehicle", "beta")
    assert not (tmp_path / "f").exists()
