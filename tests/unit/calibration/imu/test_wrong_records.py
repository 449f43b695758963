"""Calibrations of the IMU given wrong records: the good part gives its number, or a sentence says why."""

import json
import shutil
import tomllib

import numpy as np
import pytest

from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError

IMU = "t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C"
STARS = "t_exposure_s,t_arrival_s,x_m,y_m,heading_rad"
NAMES = ("omega", "ax", "ay")


class Record:
    """A data folder as arrays, and what a calibration finds in it."""

    def __init__(self, source, folder, call):
        shutil.copytree(source, folder)
        self.folder, self._call = folder, call
        self.imu = np.loadtxt(folder / "imu.csv", delimiter=",", skiprows=1)
        self.stars = np.loadtxt(folder / "stars.csv", delimiter=",", skiprows=1)

    def calibrate(self, command):
        for name, header, rows in (("imu", IMU, self.imu), ("stars", STARS, self.stars)):
            np.savetxt(self.folder / f"{name}.csv", rows, "%.9f", ",", header=header, comments="")
        out = self.folder / "found.toml"
        result = self._call("calibrate", command, self.folder, "--out", out)
        assert result.exit_code == 0, result.output
        self.output = result.output
        return tomllib.loads(out.read_text())


@pytest.fixture
def rest(make_folder, tmp_path, groundstation):
    return Record(make_folder(scenario="rest", seed=53, duration_s=60.0), tmp_path / "rest", groundstation)


@pytest.fixture
def laps(make_folder, tmp_path, groundstation):
    folder = make_folder(scenario="perimeter", seed=51, duration_s=80.0)
    return Record(folder, tmp_path / "laps", groundstation)


@pytest.fixture
def spin(make_folder, tmp_path, groundstation):
    return Record(make_folder(scenario="spin", seed=52, duration_s=60.0), tmp_path / "spin", groundstation)


def wild_one(t):
    t[2000] += 600.0


def wild_first(t):
    t[0] = 1e9


def wild_last(t):
    t[-1] = 1e9


def wild_two(t):
    t[[2000, 2001]] += 1e5


def not_a_number(t):
    t[2000] = np.nan


def swapped(t):
    t[[2000, 2001]] = t[[2001, 2000]]


def set_back(t):
    t[2000:] -= 10.0


@pytest.mark.parametrize(
    ("command", "spoil"),
    [
        *(
            ("zero-offset", spoil)
            for spoil in (wild_one, wild_first, wild_last, wild_two, not_a_number, swapped, set_back)
        ),
        ("allan", wild_one),
        ("allan", set_back),
    ],
)
def test_a_wild_stamp_costs_itself_and_is_reported(rest, command, spoil):
    plain = rest.calibrate(command)
    spoil(rest.imu[:, 0])
    found = rest.calibrate(command)
    for name, quantity in plain.items():
        if isinstance(quantity, dict) and "std" in quantity:
            assert found[name]["value"] == pytest.approx(quantity["value"], abs=0.5 * quantity["std"])
            assert found[name]["std"] == pytest.approx(quantity["std"], rel=0.15)
    if command == "zero-offset":
        assert found["packets"] >= plain["packets"] - 60
    assert len(found["set_aside"]) == 1
    assert "imu.csv: " in rest.output


def test_a_wild_stamp_costs_the_temperature_nothing(make_folder, tmp_path, groundstation):
    source = make_folder(scenario="rest", seed=54, duration_s=60.0)
    record = Record(source, tmp_path / "warm", groundstation)
    heat = np.linspace(20.0, 26.0, len(record.imu))
    record.imu[:, 4] = heat
    record.imu[:, 1] += 3e-4 * (heat - heat[0])
    plain = record.calibrate("temperature")["omega_slope"]
    record.imu[300, 0] += 600.0
    found = record.calibrate("temperature")["omega_slope"]
    assert found["value"] == pytest.approx(plain["value"], abs=0.5 * plain["std"])


@pytest.mark.parametrize("hole_s", [20.0, 40_000.0])
def test_the_noise_of_a_record_with_a_hole_is_that_of_its_pieces(rest, hole_s):
    density = np.sqrt((2e-3**2 + 1.25e-3**2 / 12) / 1000)
    rest.imu[2000:, 0] += hole_s
    meta = json.loads((rest.folder / "meta.json").read_text())
    meta["known"]["run_start_s"] += hole_s
    (rest.folder / "meta.json").write_text(json.dumps(meta))
    found = rest.calibrate("allan")
    assert found["stretches"] == 2
    for name in ("ax_random_walk", "ay_random_walk"):
        assert found[name]["value"] == pytest.approx(density, abs=4.0 * found[name]["std"])


@pytest.mark.parametrize(
    ("channel", "level", "words"),
    [
        (1, 0.0, "not connected"),
        (2, 0.0123, "stuck"),
        (3, 3.1, "stuck"),
        (1, None, "saturated"),
        (3, None, "saturated"),
    ],
)
@pytest.mark.parametrize("command", ["allan", "zero-offset"])
def test_a_dead_channel_is_named_and_the_others_stay_right(rest, channel, level, words, command):
    plain = rest.calibrate(command)
    column = rest.imu[:, channel]
    rest.imu[:, channel] = np.minimum(column, np.median(column)) if level is None else level
    found = rest.calibrate(command)
    dead = NAMES[channel - 1]
    assert words in rest.output
    assert f"{dead} " in rest.output
    for name, quantity in plain.items():
        if isinstance(quantity, dict) and "std" in quantity and name != "residual":
            if name.startswith(dead):
                assert name not in found
            else:
                assert found[name]["value"] == pytest.approx(quantity["value"], abs=0.5 * quantity["std"])


@pytest.mark.parametrize("channel", [1, 2, 3])
@pytest.mark.parametrize("command", ["allan", "zero-offset"])
def test_a_channel_that_was_stuck_for_a_while_is_left_out(rest, channel, command):
    plain = rest.calibrate(command)
    rest.imu[150:400, channel] = rest.imu[150, channel]
    found = rest.calibrate(command)
    stuck = NAMES[channel - 1]
    assert f"{stuck} was stuck: it has the same reading in 25" in rest.output
    for name, quantity in plain.items():
        if isinstance(quantity, dict) and "std" in quantity:
            if name.startswith(stuck):
                assert name not in found
            else:
                assert found[name]["value"] == pytest.approx(quantity["value"], abs=0.5 * quantity["std"])


def test_without_a_living_channel_nothing_is_written(rest):
    rest.imu[:, 1:4] = 0.0
    with pytest.raises(UsageError, match=r"omega reads 0 in 100 %.*ax reads 0.*ay reads 0"):
        rest.calibrate("allan")
    assert not (rest.folder / "found.toml").exists()


@pytest.mark.parametrize("seconds", [2, 8])
def test_a_short_rest_says_how_long_a_record_each_number_needs(rest, seconds):
    rest.imu = rest.imu[: 100 * seconds]
    found = rest.calibrate("allan")
    assert "omega_bias_instability" not in found
    assert found["ax_instability_is_upper_limit"] is True
    assert "17 min" in rest.output.replace("16.7", "17")
    assert found["ax_random_walk"]["value"] == pytest.approx(
        np.sqrt((2e-3**2 + 1.25e-3**2 / 12) / 1000), abs=4.0 * found["ax_random_walk"]["std"]
    )


def test_noise_is_told_in_everyday_units_with_a_verdict(rest):
    found = rest.calibrate("allan")
    density = found["omega_random_walk"]["value"]
    for text in (f"{np.degrees(density):.4g} deg/s/sqrt(Hz)", f"{60 * np.degrees(density):.4g} deg/sqrt(h)"):
        assert text in rest.output
    assert "ug/sqrt(Hz)" in rest.output
    assert "as stated" in found["omega_verdict"]
    meta = json.loads((rest.folder / "meta.json").read_text())
    meta["known"]["acc_noise_poll_m_s2"] /= 3.0
    (rest.folder / "meta.json").write_text(json.dumps(meta))
    assert "NOISIER" in rest.calibrate("allan")["ax_verdict"]
    offsets = rest.calibrate("zero-offset")
    assert f"{offsets['ax_offset']['value'] / 9.80665e-3:.4g} mg" in rest.output
    assert f"{np.degrees(offsets['omega_offset']['value']):.4g} deg/s" in rest.output


@pytest.mark.parametrize("command", ["zero-offset", "allan", "temperature", "gyro-scale"])
def test_a_rate_that_the_stamps_contradict_is_refused(spin, command):
    meta = json.loads((spin.folder / "meta.json").read_text())
    meta["known"]["imu_rate_hz"] = 10.0
    (spin.folder / "meta.json").write_text(json.dumps(meta))
    with pytest.raises(FileError, match=r"known\.imu_rate_hz of meta\.json is 10"):
        spin.calibrate(command)


def negated(record):
    record.stars[:, 4] *= -1.0


def gyro_negated(record):
    record.imu[:, 1] *= -1.0


def frozen(record):
    record.stars[:, 2:] = record.stars[3, 2:]


def in_degrees(record):
    record.stars[:, 4] = np.degrees(record.stars[:, 4])


def rate_in_degrees(record):
    record.imu[:, 1] = np.degrees(record.imu[:, 1])


def of_another_vehicle(record):
    record.stars[:, 4] = np.random.default_rng(1).uniform(-3.0, 3.0, len(record.stars))


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (negated, "sign of one"),
        (gyro_negated, "sign of one"),
        (frozen, "frozen"),
        (in_degrees, "degrees"),
        (rate_in_degrees, "in deg/s"),
        (of_another_vehicle, "do not follow the gyro"),
    ],
)
@pytest.mark.parametrize("command", ["gyro-scale", "delay"])
def test_headings_that_do_not_follow_the_gyro_are_refused_with_the_cause(spin, command, spoil, words):
    spoil(spin)
    with pytest.raises((UsageError, FileError), match=words):
        spin.calibrate(command)
    assert not (spin.folder / "found.toml").exists()


@pytest.mark.parametrize(("command", "name"), [("gyro-scale", "scale"), ("delay", "delay")])
def test_rows_that_come_twice_count_once(spin, command, name):
    plain = spin.calibrate(command)[name]
    spin.imu, spin.stars = np.repeat(spin.imu, 2, axis=0), np.repeat(spin.stars, 2, axis=0)
    found = spin.calibrate(command)
    assert found[name]["value"] == pytest.approx(plain["value"], abs=1e-6)
    assert found[name]["std"] == pytest.approx(plain["std"], rel=1e-3)
    assert any("came twice" in note for note in found["set_aside"])


@pytest.mark.parametrize(("command", "name"), [("gyro-scale", "scale"), ("delay", "delay")])
@pytest.mark.parametrize("spoil", ["cut", "pause", "wild"])
def test_what_the_gyro_turned_in_a_hole_is_not_guessed(spin, command, name, spoil):
    plain = spin.calibrate(command)[name]
    edge_s = spin.imu[3000, 0]
    if spoil == "cut":
        spin.imu = np.delete(spin.imu, slice(3000, 3400), axis=0)
    elif spoil == "pause":
        spin.imu[3000:, 0] += 20.0
        spin.stars[:, :2][spin.stars[:, :2] > edge_s] += 20.0
    else:
        spin.imu[3000, 0] += 600.0
    found = spin.calibrate(command)[name]
    assert found["value"] == pytest.approx(plain["value"], abs=3.0 * found["std"])
    assert found["std"] < 2.5 * plain["std"]


def headings_negated(record):
    record.stars[:, 4] *= -1.0


def headings_in_degrees(record):
    record.stars[:, 4] *= 57.3


def fixes_frozen(record):
    record.stars[:, 2:] = record.stars[0, 2:]


def places_mirrored(record):
    record.stars[:, 2] *= -1.0


def gyro_in_degrees(record):
    record.imu[:, 1] *= 57.3


def gyro_of_another_scale(record):
    record.imu[:, 1] *= 1.2


def accelerometers_in_g(record):
    record.imu[:, 2:4] /= 9.81


def accelerometers_negated(record):
    record.imu[:, 2:4] *= -1.0


def accelerometers_swapped(record):
    record.imu[:, 2:4] = record.imu[:, 3:1:-1].copy()


@pytest.mark.parametrize(
    ("spoil", "cause"),
    [
        (headings_negated, "the sign of one of them is wrong"),
        (headings_in_degrees, "seem to be degrees"),
        (fixes_frozen, r"frozen fixes\?$"),
        (gyro_in_degrees, "deg/s"),
        (gyro_of_another_scale, "the best scale is 0.16"),
    ],
)
def test_joint_constants_that_cannot_be_right_are_refused_with_the_likely_cause(spin, spoil, cause):
    spoil(spin)
    with pytest.raises((UsageError, FileError), match=cause):
        spin.calibrate("joint")
    assert not (spin.folder / "found.toml").exists()


@pytest.mark.parametrize(
    "spoil", [places_mirrored, accelerometers_in_g, accelerometers_negated, accelerometers_swapped]
)
def test_joint_constants_of_axes_that_contradict_each_other_are_refused(laps, spoil):
    spoil(laps)
    with pytest.raises(UsageError, match="sign, unit and order of the accelerometers and of x and y"):
        laps.calibrate("joint")
    assert not (laps.folder / "found.toml").exists()


def test_a_temperature_that_no_chip_has_costs_itself_and_is_reported(rest):
    rest.imu[:, 4] = np.linspace(20.0, 26.0, len(rest.imu))
    right = rest.calibrate("temperature")
    rest.imu[::50, 4] = 9249.0
    found = rest.calibrate("temperature")
    assert f"{len(rest.imu[::50])} of {len(rest.imu)} temperatures set aside" in rest.output
    for name in ("omega_slope", "ax_slope", "ay_slope"):
        assert found[name]["value"] == pytest.approx(right[name]["value"], abs=0.5 * right[name]["std"])


@pytest.mark.parametrize("command", ["temperature", "zero-offset"])
def test_temperatures_in_kelvin_are_refused(rest, command):
    rest.imu[:, 4] += 273.15
    with pytest.raises(FileError, match=r"imu\.csv: temperature_C is 29\d.* degrees Celsius are expected"):
        rest.calibrate(command)


@pytest.mark.parametrize("command", ["joint", "table-map", "gyro-scale"])
@pytest.mark.parametrize("factor", [1e3, 1e2])
def test_places_in_other_units_are_refused(spin, command, factor):
    spin.stars[:, 2:4] = (spin.stars[:, 2:4] + 1.0) * factor
    with pytest.raises(FileError, match=r"stars\.csv: x_m and y_m are .* Metres are expected"):
        spin.calibrate(command)


def test_an_exposure_that_arrives_again_later_counts_once(spin):
    once = spin.calibrate("gyro-scale")
    again = spin.stars.copy()
    again[:, 1] += 0.01
    spin.stars = np.concatenate([spin.stars, again])
    found = spin.calibrate("gyro-scale")
    assert found["scale"]["std"] == pytest.approx(once["scale"]["std"], rel=1e-9)
    assert f"{len(again)} fixes that came twice" in spin.output


def block_twice(rows):
    quarter = len(rows) // 4
    return np.concatenate([rows[: 2 * quarter], rows[quarter:]])


def file_twice(rows):
    return np.concatenate([rows, rows])


@pytest.mark.parametrize("spoil", [block_twice, file_twice])
@pytest.mark.parametrize("command", ["zero-offset", "allan"])
def test_rows_that_were_pasted_twice_count_once(rest, command, spoil):
    plain = rest.calibrate(command)
    rest.imu = spoil(rest.imu)
    found = rest.calibrate(command)
    for name, quantity in plain.items():
        if isinstance(quantity, dict) and "std" in quantity:
            assert found[name] == quantity
    assert any("those of an earlier line" in note for note in found["set_aside"])


@pytest.mark.parametrize("command", ["gyro-scale", "delay"])
def test_packets_of_turns_that_were_pasted_twice_count_once(spin, command):
    name = "scale" if command == "gyro-scale" else "delay"
    plain = spin.calibrate(command)[name]
    spin.imu = block_twice(spin.imu)
    assert spin.calibrate(command)[name] == plain


@pytest.mark.parametrize(
    ("channels", "factor", "unit"),
    [([1], np.degrees(1.0), "deg/s"), ([2, 3], 1.0 / 9.80665, "g"), ([2, 3], 1e3 / 9.80665, "mg")],
)
@pytest.mark.parametrize("command", ["zero-offset", "allan"])
def test_a_channel_in_another_unit_is_told_by_its_noise(rest, command, channels, factor, unit):
    plain = rest.calibrate(command)
    rest.imu[:, channels] *= factor
    found = rest.calibrate(command)
    wrong = {NAMES[channel - 1] for channel in channels}
    for name, quantity in plain.items():
        if isinstance(quantity, dict) and name.split("_")[0] in wrong:
            assert name not in found
        elif isinstance(quantity, dict) and "std" in quantity:
            assert found[name]["value"] == pytest.approx(quantity["value"], abs=0.5 * quantity["std"])
            assert found[name]["std"] == pytest.approx(quantity["std"], rel=0.15)
    for name in wrong:
        assert f"{name} is " in rest.output
        assert f"as if it were in {unit}: " in rest.output


def test_a_delay_of_a_gyro_that_was_at_its_limit_is_refused(laps):
    laps.imu[:, 1] = np.minimum(laps.imu[:, 1], 0.8 * laps.imu[:, 1].max())
    with pytest.raises(UsageError, match=r"omega (was stuck|is saturated|reads)"):
        laps.calibrate("delay")


def test_fixes_stamped_in_milliseconds_have_no_delay(laps):
    laps.stars[:, :2] *= 1e3
    with pytest.raises(FileError, match=r"no t_arrival_s lies within .* in milliseconds"):
        laps.calibrate("delay")


def test_a_picture_does_not_arrive_before_it_is_taken(laps):
    laps.stars[:, 1] = laps.stars[:, 0] - 0.3
    with pytest.raises(UsageError, match="no picture arrives before it is taken"):
        laps.calibrate("delay")
