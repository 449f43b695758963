"""What a rig says to its estimators: one noise model, table map, calibrated constants; and refusals."""

import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from calibration.result import CalibrationResult, Provenance, Quantity
from groundstation.declarations.errors import RigError
from groundstation.fusion import error_state as es
from groundstation.fusion.slope_grid import RELEVELLING_SIGMA_M_S2
from groundstation.fusion.table_map import MapProvenance, TableMap
from groundstation.parts.fusion.estimation import calibration_texts, noise_of, rig_noise
from groundstation.rig.provenance import file_hashes
from groundstation.rig.read import parse_rig

RIGS = Path(__file__).parents[5] / "examples" / "rigs"
NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)


def rig_of(folder, table="", imu="", more=""):
    """The example of drawn fixes with lines added to its table and to its IMU."""
    text = (RIGS / "drawn_fixes.toml").read_text()
    text = text.replace("y_max_m = 1.5\n", f"y_max_m = 1.5\n{table}\n", 1)
    text = text.replace("baud = 250000\n", f"baud = 250000\n{imu}\n", 1)
    return parse_rig(text + more, folder / "rig.toml")


def write_map(path, sigma_m_s2=1e-4):
    y, x = np.meshgrid(np.linspace(-1.5, 1.5, 7), np.linspace(-2.0, 2.0, 9), indexing="ij")
    sigma, nothing = np.full(x.shape, sigma_m_s2), np.zeros_like(x)
    TableMap(
        -2.0, -1.5, 0.5, 1e-3 * x, -2e-3 * y, sigma, sigma, nothing, (0.0, 0.0), 1e-9 * np.eye(2), 1e-3,
        MapProvenance(NOON, {"laps.mcap": "0" * 64}, 1.0, 300.0),
    ).save(path)  # fmt: skip


def write_constants(path, **quantities):
    made = {name: Quantity(*what) for name, what in quantities.items()}
    path.write_text(CalibrationResult("test", Provenance("r.mcap", "0" * 64, NOON), made).to_toml())


def test_a_rig_without_files_gives_its_own_figures(tmp_path):
    rig = rig_of(tmp_path, "slope_sigma_m_s2 = 0.005\nwaviness_sigma_m_s2 = 0.0004\nwaviness_length_m = 0.2")
    noise = noise_of(rig, "alpha")
    assert (noise.slope_sigma_m_s2, noise.waviness_sigma_m_s2, noise.waviness_length_m) == (
        0.005,
        0.0004,
        0.2,
    )
    assert rig.table.slope_grid() is None
    assert calibration_texts(rig, "alpha") == {}


def test_a_map_takes_the_place_of_the_slopes_sigma_and_is_part_of_the_provenance(tmp_path):
    write_map(tmp_path / "map.toml")
    rig = rig_of(tmp_path, 'map = "map.toml"')
    noise = noise_of(rig, "alpha")
    assert noise.slope_sigma_m_s2 == RELEVELLING_SIGMA_M_S2
    assert noise.waviness_sigma_m_s2 == pytest.approx(1.25e-4)
    assert rig_noise(rig, "alpha").slope_sigma_m_s2 > noise.slope_sigma_m_s2
    assert rig.table.slope_grid().at(0.5, 0.5) == pytest.approx((5e-4, -1e-3))
    digest, text = calibration_texts(rig, "alpha")["table.map"]
    assert file_hashes(rig)["table.map"] == digest
    assert text == (tmp_path / "map.toml").read_text()


def test_constants_of_files_are_weighed_against_the_rigs(tmp_path):
    write_constants(
        tmp_path / "joint.toml",
        gyro_scale=(4e-3, 1e-4, "1"),
        acc_scale_x=(0.03, 0.01, "1"),
        lever_x=(0.035, 5e-4, "m"),
        acc_y_temperature_slope=(5e-4, 1e-6, "m/s^2/C"),
        camera_delay=(3e-3, 1e-3, "s"),
        slope_x=(1.0, 1e-9, "m/s^2"),
    )
    write_constants(tmp_path / "scale.toml", scale=(5e-3, 2e-5, "1"))
    rig = rig_of(tmp_path, imu='calibration = ["joint.toml", "scale.toml"]')
    noise = noise_of(rig, "alpha")
    x, sigma = es.initial_state(noise), np.sqrt(es.initial_variance(noise))
    assert x[es.GYRO_SCALE] == pytest.approx(5e-3, rel=1e-3)  # the surer of the two files
    assert sigma[es.GYRO_SCALE] == pytest.approx(2e-5, rel=1e-3)
    assert x[es.ACC_MATRIX] == pytest.approx(0.015)  # as sure as the data sheet: half way
    assert sigma[es.ACC_MATRIX] == pytest.approx(0.01 / 2**0.5)
    assert noise.imu_offset_x_m == x[es.LEVER_X] == pytest.approx(0.035 - 0.2 * (0.035 - 0.03151))
    assert x[es.ACC_TEMPCO_Y] == pytest.approx(5e-4, rel=1e-2)
    assert x[es.ACC_TEMPCO_X] == pytest.approx(3e-4)
    assert x[es.FIX_DELAY] == pytest.approx(3e-3)
    assert x[es.SLOPE_X] == 0.0  # of that day's place, not of this one


@pytest.mark.parametrize(
    ("table", "imu", "reported"),
    [
        ('map = "nowhere.toml"', "", r"table\.map: .*nowhere\.toml: cannot be read"),
        ('map = "torn.toml"', "", r"table\.map: .*torn\.toml: is not valid TOML"),
        ('map = "joint.toml"', "", r"table\.map: .*joint\.toml: key grid is missing"),
        ("", 'calibration = ["nowhere.toml"]', r"imu\.calibration\.0: .*nowhere\.toml: cannot be read"),
        ("", 'calibration = ["rest.toml"]', r"rest\.toml holds no constant that lasts"),
        ("", 'calibration = ["unit.toml"]', r"unit\.toml: lever_x must be in the unit 'm', found 'mm'"),
    ],
)
def test_a_wrong_file_is_one_sentence_before_anything_starts(tmp_path, table, imu, reported):
    (tmp_path / "torn.toml").write_text("[grid")
    write_constants(tmp_path / "joint.toml", gyro_scale=(4e-3, 1e-4, "1"))
    write_constants(tmp_path / "rest.toml", omega_offset=(4e-3, 1e-4, "rad/s"))
    write_constants(tmp_path / "unit.toml", lever_x=(35.0, 1.0, "mm"))
    with pytest.raises(RigError, match=reported) as found:
        rig_of(tmp_path, table, imu)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("table", "more", "reported"),
    [
        ("legs = { A = [0.0, 0.0], B = [1.0, 0.0] }", "", "table: legs: a table needs at least three legs"),
        ("legs = { A = [0.0, 0.0], B = [1.0, 0.0], C = [2.0, 0.0] }", "", "legs stand on one line"),
        ('map = "m.toml"', '\n[mock_ups.standard.fusion]\nmethod = "reintegration"\n', "takes no map"),
        ("slope_sigma_m_s2 = 0.0", "", "table.slope_sigma_m_s2"),
    ],
)
def test_keys_that_cannot_be_are_refused(tmp_path, table, more, reported):
    write_map(tmp_path / "m.toml")
    with pytest.raises(RigError, match=re.escape(reported)):
        rig_of(tmp_path, table, more=more)
