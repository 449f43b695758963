"""`groundstation fusion run` as a user meets it: outputs, and one sentence for what is wrong."""

import json
import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from groundstation.cli.fusion import app
from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError


@pytest.fixture
def folder(make_folder, tmp_path):
    source = make_folder(scenario="station", seed=41, duration_s=16.0, run_start_s=5.0)
    return shutil.copytree(source, tmp_path / "data")


def run(*arguments: object):
    return CliRunner().invoke(app, ["run", *map(str, arguments)])


def refusal(*arguments: object) -> str:
    result = run(*arguments)
    assert isinstance(result.exception, UsageError | FileError), result.output
    return str(result.exception)


@pytest.mark.parametrize("method", ["filter", "reintegration"])
def test_it_writes_a_row_per_packet_and_accounts_for_every_fix(folder, tmp_path, method):
    result = run(folder, "--out", tmp_path / "estimate.csv", "--method", method)
    assert result.exit_code == 0, result.output
    estimate = np.genfromtxt(tmp_path / "estimate.csv", delimiter=",", names=True)
    packets = np.genfromtxt(folder / "imu.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(estimate["t_s"], packets["t_s"])
    header = (tmp_path / "estimate.csv").read_text().splitlines()[0].split(",")
    assert header[-3:] == ["std_x_m", "std_y_m", "std_heading_rad"]
    fixes = (tmp_path / "fixes.csv").read_text().splitlines()
    assert fixes[0] == "t_exposure_s,used,reason,innovation_x_m,innovation_y_m,innovation_heading_rad,nis"
    assert len(fixes) == len((folder / "stars.csv").read_text().splitlines())
    assert not any("waits" in line for line in fixes)
    used = np.array([row.split(",")[3:6] for row in fixes[1:] if ",used," in row], dtype=float)[1:]
    assert len(used) > 5
    assert (np.abs(used).max(axis=0) > 0.0).all()
    assert np.abs(used).max() < 0.1  # metres and radians: compared with what was expected, not with zero


def test_the_estimate_is_causal(folder, tmp_path):
    run(folder, "--out", tmp_path / "whole.csv")
    for name, column in (("imu.csv", 0), ("stars.csv", 1)):
        lines = (folder / name).read_text().splitlines(keepends=True)
        kept = [line for line in lines[1:] if float(line.split(",")[column]) <= 11.0]
        (folder / name).write_text("".join([lines[0], *kept]))
    run(folder, "--out", tmp_path / "cut.csv")
    cut = (tmp_path / "cut.csv").read_text()
    assert (tmp_path / "whole.csv").read_text().startswith(cut)


def test_columns_may_stand_in_any_order(folder, tmp_path):
    run(folder, "--out", tmp_path / "a.csv")
    rows = [line.split(",")[::-1] for line in (folder / "stars.csv").read_text().splitlines()]
    (folder / "stars.csv").write_text("".join(",".join(row) + "\n" for row in rows))
    run(folder, "--out", tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_text() == (tmp_path / "b.csv").read_text()


@pytest.mark.parametrize("name", ["imu.csv", "stars.csv", "meta.json"])
def test_a_missing_file_is_named(folder, tmp_path, name):
    (folder / name).unlink()
    assert f"{name}: cannot be read" in refusal(folder, "--out", tmp_path / "e.csv")
    assert not (tmp_path / "e.csv").exists()


def test_a_missing_column_is_named(folder, tmp_path):
    text = (folder / "imu.csv").read_text().replace("ay_m_s2", "ay")
    (folder / "imu.csv").write_text(text)
    assert "line 1, column 'ay_m_s2' is missing" in refusal(folder, "--out", tmp_path / "e.csv")


def test_a_word_among_numbers_is_named_with_its_line(folder, tmp_path):
    lines = (folder / "imu.csv").read_text().splitlines()
    cells = lines[7].split(",")
    lines[7] = ",".join([cells[0], "oops", *cells[2:]])
    (folder / "imu.csv").write_text("\n".join(lines))
    message = refusal(folder, "--out", tmp_path / "e.csv")
    assert "line 8" in message
    assert "omega_rad_s" in message
    assert "oops" in message


@pytest.mark.parametrize("content", ["", "t_s,omega_rad_s,ax_m_s2,ay_m_s2,temperature_C\n"])
def test_an_empty_file_is_refused(folder, tmp_path, content):
    (folder / "imu.csv").write_text(content)
    assert "imu.csv" in refusal(folder, "--out", tmp_path / "e.csv")


@pytest.mark.parametrize(
    ("key", "value"),
    [("imu_rate_hz", None), ("imu_rate_hz", 0.0), ("imu_offset_m", [1.0]), ("acc_lsb_m_s2", "x"),
     ("star_delay_s", 600.0), ("mass_kg", 1e300), ("mass_kg", "11"), ("imu_offset_m", [31.51, -21.22]),
     ("imu_offset_m", [0.0, -50.0]), ("run_start_s", 1e9), ("run_start_s", -1.0), ("duration_s", 1e300),
     ("star_sigma_heading_rad", 50.0), ("star_sigma_xy_m", 1e-300), ("gyro_bandwidth_hz", -40.0)],
)  # fmt: skip
def test_a_wrong_key_is_named(folder, tmp_path, key, value):
    meta = json.loads((folder / "meta.json").read_text())
    meta["known"][key] = value
    (folder / "meta.json").write_text(json.dumps(meta))
    message = refusal(folder, "--out", tmp_path / "e.csv")
    assert f"known.{key} " in message
    assert "expected" in message or "missing" in message or "must be" in message


def test_meta_that_is_no_json_is_refused_with_its_line(folder, tmp_path):
    (folder / "meta.json").write_text('{"known": {\n "a": 1,\n "b": ?}}')
    assert "line 3" in refusal(folder, "--out", tmp_path / "e.csv")


def test_only_the_known_block_is_read(folder, tmp_path):
    run(folder, "--out", tmp_path / "a.csv")
    meta = json.loads((folder / "meta.json").read_text())
    (folder / "meta.json").write_text(json.dumps({"known": meta["known"]}))
    run(folder, "--out", tmp_path / "b.csv")
    assert (tmp_path / "a.csv").read_text() == (tmp_path / "b.csv").read_text()


def test_an_unknown_method_and_an_unwritable_place_are_refused(folder, tmp_path):
    assert "--method" in refusal(folder, "--out", tmp_path / "e.csv", "--method", "guess")
    assert "cannot be written" in refusal(folder, "--out", tmp_path / "nowhere" / "e.csv")
    assert "must not be called fixes.csv" in refusal(folder, "--out", tmp_path / "fixes.csv")
    assert "is a file that is read" in refusal(folder, "--out", folder / "imu.csv")


def test_shuffled_and_broken_rows_are_survived_and_counted(folder, tmp_path):
    lines = (folder / "imu.csv").read_text().splitlines(keepends=True)
    lines[500], lines[501] = lines[501], lines[500]
    lines.insert(700, lines[699])
    cells = lines[900].split(",")
    lines[900] = ",".join([cells[0], "nan", *cells[2:]])
    (folder / "imu.csv").write_text("".join(lines))
    result = run(folder, "--out", tmp_path / "e.csv")
    assert result.exit_code == 0
    assert "packet stamp not after the last: 1" in result.output
    assert "packet repeated: 1" in result.output
    assert "packet wild" in result.output
    assert len((tmp_path / "e.csv").read_text().splitlines()) == len(lines)


def jump_back(lines):
    return [
        *lines[:900],
        *[f"{float(a) - 4.0:.6f},{b}" for a, b in (row.split(",", 1) for row in lines[900:])],
    ]


def twice(lines):
    return [*lines[:700], *lines[690:]]


def gap(lines):
    return [*lines[:700], *lines[760:]]


def nan_readings(lines):
    return [*lines[:800], *[row.split(",")[0] + ",nan,nan,nan,nan\n" for row in lines[800:803]], *lines[803:]]


def nan_stamp(lines):
    return [*lines[:800], "nan," + lines[800].split(",", 1)[1], *lines[801:]]


@pytest.mark.parametrize(
    ("spoil", "counter"),
    [
        (jump_back, "clock jumped back: 1"),
        (twice, "packet repeated: 10"),
        (gap, "packet hole"),
        (nan_readings, "packet wild"),
        (nan_stamp, "packet stamp not finite: 1"),
    ],
)
def test_a_spoilt_recording_is_survived_with_a_named_counter(folder, tmp_path, spoil, counter):
    header, *lines = (folder / "imu.csv").read_text().splitlines(keepends=True)
    (folder / "imu.csv").write_text("".join([header, *spoil(lines)]))
    result = run(folder, "--out", tmp_path / "e.csv")
    assert result.exit_code == 0, result.output
    assert counter in result.output
    known = np.genfromtxt(tmp_path / "e.csv", delimiter=",", names=True)["x_m"]
    assert np.isfinite(known[-100:]).all()
    assert np.ptp(known[np.isfinite(known)]) < 1.0


def test_fixes_before_the_first_packet_are_refused_by_name(folder, tmp_path):
    header, *rows = (folder / "stars.csv").read_text().splitlines(keepends=True)
    early = "-1.5,-0.9," + rows[0].split(",", 2)[2]
    (folder / "stars.csv").write_text("".join([header, early, *rows]))
    result = run(folder, "--out", tmp_path / "e.csv")
    assert "fix before the first packet: 1" in result.output
    assert ",0,before the first packet," in (tmp_path / "fixes.csv").read_text().splitlines()[1]


def test_a_filter_that_lost_itself_says_so_and_starts_again(folder, tmp_path):
    header, *rows = (folder / "stars.csv").read_text().splitlines()
    moved = []
    for row in rows:  # someone lifts the vehicle and sets it down elsewhere; nothing feels it
        exposure, arrival, x, *rest = row.split(",")
        moved.append(",".join([exposure, arrival, str(float(x) + 0.5 * (float(exposure) > 8.0)), *rest]))
    (folder / "stars.csv").write_text("\n".join([header, *moved]) + "\n")
    result = run(folder, "--out", tmp_path / "e.csv")
    assert "fix starts the estimate again: 1" in result.output
    reasons = [line.split(",")[2] for line in (tmp_path / "fixes.csv").read_text().splitlines()[1:]]
    assert reasons.count("outside the gate") == 3
    assert reasons[-2] == "used"


@pytest.mark.parametrize("method", ["reintegration", "stars", "imu"])
def test_the_published_methods_answer_each_packet_and_draw_it(folder, tmp_path, method):
    plot = tmp_path / "plot.png"
    result = run(folder, "--out", tmp_path / "estimate.csv", "--method", method, "--plot", plot)
    assert result.exit_code == 0, result.output
    estimate = np.genfromtxt(tmp_path / "estimate.csv", delimiter=",", names=True)
    assert np.isfinite(estimate["x_m"][-500:]).all()
    assert plot.read_bytes().startswith(b"\x89PNG")


def test_what_we_added_to_the_published_methods_changes_them_only_when_asked(folder, tmp_path):
    out, texts = tmp_path / "e.csv", []
    for words in ((), ("--exact-steps",), ("--fit-after", 5)):
        assert run(folder, "--out", out, "--method", "reintegration", *words).exit_code == 0
        texts.append(out.read_text())
    assert len(set(texts)) == 3


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--median-zeros",), "go with --method reintegration, stars, imu"),
        (("--method", "imu", "--fit-after", "0"), "above zero"),
        (("--method", "none"), "one of filter, reintegration, stars, imu"),
    ],
)
def test_options_that_nothing_takes_are_refused(folder, tmp_path, words, sentence):
    assert sentence in refusal(folder, "--out", tmp_path / "e.csv", *words)
