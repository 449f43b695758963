"""Recordings and folders become the same kind of flight."""

from pathlib import Path

import numpy as np
import pytest

from calibration.flights import opened, read_flight
from groundstation.declarations.errors import UsageError
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.stars.messages import StarFix
from groundstation.rig.read import load_rig, read_text

RIGS = Path(__file__).parents[3] / "examples" / "rigs"


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = tmp_path_factory.mktemp("flights") / "run.mcap"
    rig_path = RIGS / "drawn_fixes.toml"
    run_lockstep(load_rig(rig_path), read_text(rig_path), rig_path, path, 12.0, 3, lambda *_: None)
    return path


def test_each_fix_of_a_recording_has_its_own_covariance_and_the_rigs_floor(recording):
    data = read_flight(recording)
    with opened(recording) as (file, rig):
        floor_m, floor_rad = rig.tables.fix_sources["stars"].floor(rig, "alpha")
        fixes = [message.payload for message in file.messages((StarFix,), ("alpha",))]
    own = np.array([fix.covariance for fix in fixes if fix.fix]).reshape(-1, 3, 3)
    assert len(own) >= 5
    np.testing.assert_allclose(
        data.covariance, own + np.diag([floor_m**2, floor_m**2, floor_rad**2]), rtol=1e-12
    )
    assert data.noise.star_sigma_xy_m == pytest.approx(np.sqrt(np.median(data.covariance[:, 0, 0])), rel=0.2)


def test_the_reference_comes_along_on_the_same_clock(recording):
    data = read_flight(recording)
    assert len(data.reference) > 200
    t, x, y, *_ = data.reference.T
    seen = np.column_stack([np.interp(data.stars[:, 0], t, x), np.interp(data.stars[:, 0], t, y)])
    assert np.abs(seen - data.stars[:, 2:4]).max() < 0.01


def test_stamps_rise_and_the_rest_ends_when_the_vehicle_floats(recording):
    data = read_flight(recording)
    assert (np.diff(data.imu[:, 0]) > 0.0).all()
    assert (np.diff(data.stars[:, 1]) >= 0.0).all()
    assert 0.0 < data.run_start_s < data.imu[-1, 0]
    assert len(data.at_rest()) == (data.imu[:, 0] <= data.run_start_s).sum()


def test_turn_rates_are_asked_of_vehicles_with_a_star_camera_only(recording):
    with pytest.raises(UsageError, match="star cameras fly on no vehicle"):
        read_flight(recording, rates_only=True)
    with pytest.raises(UsageError, match="no vehicle 'beta': there are alpha"):
        read_flight(recording, "beta")


def test_a_folder_says_one_sigma_for_all_fixes(make_folder):
    data = read_flight(make_folder(scenario="station", seed=51, duration_s=20.0))
    sigma = data.noise.star_sigma_xy_m, data.noise.star_sigma_xy_m, data.noise.star_sigma_heading_rad
    assert data.covariance.shape == (len(data.stars), 3, 3)
    np.testing.assert_array_equal(data.covariance[-1], np.diag(np.square(sigma)))
    assert not len(data.reference)
