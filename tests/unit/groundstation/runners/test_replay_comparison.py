"""Tolerances are data; angles are compared across their seam."""

import math

import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.declarations.errors import UsageError
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recorded
from groundstation.runners.replay_comparison import difference
from groundstation.runners.tolerances import EXACT, Tolerances, load_tolerances

CODEC = codec_of(ControlStatus)
PAYLOADS = installed_tables().payloads


def status(heading_rad=0.0, error_m=0.0, position=(0.0, 0.0)):
    return ControlStatus(5, "alpha", "station", position, heading_rad, error_m, 0.0, (), ())


def compare(then, now, **allowed):
    envelope = Envelope(ControlStatus.TOPIC, "alpha", 3, 5)
    recorded = Recorded(envelope, CODEC.encode(then), 5, CODEC.decode)
    return difference(recorded, now, Tolerances({"control_status": allowed}))


def test_equal_bits_need_no_tolerance():
    assert compare(status(math.nan), status(math.nan)) == (True, None)


def test_an_angle_that_crossed_the_seam_is_close():
    then, now = status(math.pi - 1e-10), status(-math.pi + 1e-10)
    assert compare(then, now, goal_heading_rad=1e-9) == (False, None)
    assert compare(then, now)[1].field == "goal_heading_rad"


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.1])
def test_what_is_not_a_number_is_never_close_to_one(value):
    assert compare(status(error_m=1.0), status(error_m=value), error_position_m=0.01)[1] is not None
    assert compare(status(error_m=value), status(error_m=1.0), error_position_m=0.01)[1] is not None


def test_infinity_is_close_to_itself():
    then, now = status(error_m=math.inf, position=(1.0, 2.0)), status(error_m=math.inf, position=(1.0, 2.1))
    assert compare(then, now, error_position_m=0.1, goal_position_table_m=0.2) == (False, None)


def test_texts_and_integers_have_no_tolerance():
    then, now = status(), ControlStatus(5, "alpha", "brake", (0.0, 0.0), 0.0, 0.0, 0.0, (), ())
    found = compare(then, now)[1]
    assert (found.field, found.recorded, found.replayed) == ("controller", "'station'", "'brake'")
    assert "sequence 3" in str(found)


def test_tolerances_are_read_from_toml(tmp_path):
    path = tmp_path / "t.toml"
    path.write_text("[wrench]\nforce_x_n = 1e-9\n[fix_account]\nnis = 1\n")
    assert load_tolerances(path, PAYLOADS) == Tolerances(
        {"wrench": {"force_x_n": 1e-9}, "fix_account": {"nis": 1}}
    )


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("[sate]\n", "'sate' is no topic"),
        ("state = 1\n", "expected a table"),
        ("[wrench]\nforce_x_kn = 1\n", "no field of floating-point"),
        ("[control_status]\ncontroller = 1\n", "no field of floating-point"),
        ("[wrench]\nforce_x_n = -1\n", "from 0 up"),
        ("[wrench]\nforce_x_n = nan\n", "from 0 up"),
        ("[wrench]\nforce_x_n = inf\n", "from 0 up"),
        ("[default]\nm = -1\n", "default.m: expected a number from 0 up"),
        ("default = 1e-9\n", "expected a table"),
        ("[default]\nfurlong = 1e-9\n", "default.furlong is no field"),
        ("[wrench]\nforce_x_n = true\n", "from 0 up"),
        ("[state\n", "is not valid TOML"),
    ],
)
def test_wrong_tolerances_are_refused_in_one_sentence(tmp_path, text, sentence):
    path = tmp_path / "t.toml"
    path.write_text(text)
    with pytest.raises(UsageError, match=sentence):
        load_tolerances(path, PAYLOADS)


def test_tolerances_that_are_not_there_are_refused(tmp_path):
    with pytest.raises(UsageError, match="cannot be read"):
        load_tolerances(tmp_path / "nothing.toml", PAYLOADS)


def test_what_no_table_of_a_topic_names_has_the_tolerance_of_its_unit(tmp_path):
    path = tmp_path / "t.toml"
    path.write_text("[default]\nm = 1e-9\nrad_s = 1e-8\nother = 1e-3\n[wrench]\nforce_x_n = 0.5\n")
    found = load_tolerances(path, PAYLOADS)
    assert found.allowed("wrench", "force_x_n") == 0.5
    assert found.allowed("state", "position_table_m") == 1e-9
    assert found.allowed("imu", "rate_body_rad_s") == 1e-8
    assert found.allowed("fix_account", "nis") == 1e-3
    assert EXACT.allowed("state", "position_table_m") is None


def test_a_unit_forgives_numbers_and_nothing_else():
    def replayed(now):
        envelope = Envelope(ControlStatus.TOPIC, "alpha", 3, 5)
        recorded = Recorded(envelope, CODEC.encode(status()), 5, CODEC.decode)
        return difference(recorded, now, Tolerances(by_unit={"m": 0.1, "ns": 1e9, "other": 1e9}))

    assert replayed(status(error_m=0.09)) == (False, None)
    assert replayed(status(error_m=0.11))[1].apart == pytest.approx(0.11)
    assert (
        replayed(ControlStatus(6, "alpha", "station", (0.0, 0.0), 0.0, 0.0, 0.0, (), ()))[1].field
        == "stamp_ns"
    )
    assert replayed(ControlStatus(5, "alpha", "brake", (0.0, 0.0), 0.0, 0.0, 0.0, (), ()))[1].apart is None


def test_a_difference_is_told_with_its_size():
    assert "0.25 apart, sequence 3" in str(compare(status(), status(error_m=0.25))[1])
