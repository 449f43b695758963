"""The measured delay on its way from the calibration's file to the stamps and to fusion."""

import math
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from calibration.result import provenance_of
from calibration.sky.delay import delay_from_headings
from groundstation.files.errors import FileError
from groundstation.parts.stars.sections import StarsOfType
from groundstation.rig.plan import make_node
from groundstation.rig.read import parse_rig
from groundstation.star_tracking.stamp_delay import read_delay

RIG = Path(__file__).parents[4] / "examples" / "rigs" / "published_condition.toml"
DELAY_S = 0.087
JITTER_S = 0.004


@pytest.fixture(scope="module")
def measured():
    """A mock-up that turns to and fro; every picture comes a little earlier or later."""
    rng = np.random.default_rng(4)
    t = np.arange(0.004, 40.0, 0.004)

    def angle(at):
        return 0.8 * np.sin(1.1 * at) + 0.2 * np.sin(3.1 * at)

    rate = (angle(t) - angle(t - 0.004)) / 0.004 + rng.normal(0.0, 0.01, len(t))
    exposure = np.arange(2.0, 38.0, 0.07)
    heading = angle(exposure) + rng.normal(0.0, 3e-4, len(exposure))
    arrival = exposure + DELAY_S + rng.normal(0.0, JITTER_S, len(exposure))
    return delay_from_headings(t, rate, arrival, heading, guess_s=0.3)


@pytest.fixture
def delay_file(measured, tmp_path):
    (tmp_path / "imu.csv").write_text("t_s,omega_rad_s\n")
    path = tmp_path / "delay.toml"
    path.write_text(measured.to_toml(provenance_of(tmp_path, datetime(2030, 1, 1, tzinfo=UTC))))
    return path


def test_delay_and_jitter_are_found_from_a_guess_far_off(measured):
    delay, jitter = measured.quantities["delay"], measured.quantities["jitter"]
    assert delay.value == pytest.approx(DELAY_S, abs=4 * delay.sigma)
    assert delay.sigma < 1e-3
    assert jitter.value == pytest.approx(JITTER_S, rel=0.2)
    assert len(measured.draw().axes) == 2


def test_the_rig_hands_the_measured_delay_to_the_stamps_and_its_spread_to_fusion(measured, delay_file):
    text = RIG.read_text().replace("../../calibration", str(RIG.parents[2] / "calibration"))
    text = text.replace("delay_s = 0.015\ndelay_sigma_s = 0.001", f'delay_file = "{delay_file.name}"', 1)
    rig = parse_rig(text, delay_file.with_name("rig.toml"))
    delay, jitter = measured.quantities["delay"], measured.quantities["jitter"]
    sigma_s = math.hypot(delay.sigma, jitter.value)
    camera = rig.of_type("alpha", StarsOfType).star_camera
    assert camera.delay == pytest.approx((delay.value, sigma_s), rel=1e-6)
    fusion = make_node(rig, "alpha/fusion")
    assert fusion._estimator.noise.fix_delay_sigma_s == camera.delay[1]
    tracker = make_node(rig, "alpha/star_tracker")
    assert (tracker._delay.delay_s, tracker._delay.delay_sigma_s) == camera.delay


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[delay]", "[delai]", "'value' of [delay] is missing"),
        ("std", "sigma", "'std' of [delay] is missing"),
        ('unit = "s"', 'unit = "ms"', "expected 's'"),
        ("[delay]", "[delay", "not valid TOML"),
    ],
)
def test_a_wrong_delay_file_is_refused_in_one_sentence(delay_file, old, new, words):
    delay_file.write_text(delay_file.read_text().replace(old, new, 1))
    with pytest.raises(FileError) as refusal:
        read_delay(delay_file)
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("value", ["-0.01", "nan", "true", '"long"'])
def test_an_impossible_delay_is_refused(tmp_path, value):
    path = tmp_path / "delay.toml"
    path.write_text(f'[delay]\nvalue = {value}\nstd = 0.001\nunit = "s"\n')
    with pytest.raises(FileError, match=r"value of \[delay\] is"):
        read_delay(path)
