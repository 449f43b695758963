"""A run as a film and two runs beside each other, read from a flight that was recorded."""

import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.cli.main import call
from groundstation.parts.overhead.messages import OverheadImage
from groundstation.parts.table import installed_tables
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.writer import Recorder
from groundstation.watch.comparison import Figure, compare_runs
from groundstation.watch.field_plot import thinned, unit_of
from groundstation.watch.flown_run import read_run
from groundstation.watch.table_picture import TablePicture, mode_at, pose_at

SOURCE = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"


@pytest.fixture(scope="module")
def run():
    return read_run(SOURCE, installed_tables())


def pictures(path):
    video = cv2.VideoCapture(str(path))
    found = []
    while (one := video.read())[0]:
        found.append(one[1])
    return found


def test_a_film_has_a_picture_for_each_moment(tmp_path, capsys):
    words = [
        "recording",
        "film",
        str(SOURCE),
        "--from-s",
        "4",
        "--to-s",
        "5",
        "--fps",
        "10",
        "--height",
        "240",
    ]
    for ending in (".avi", ".mp4"):
        assert call([*words, "--out", str(tmp_path / f"a{ending}")]) == 0
        assert "10 pictures" in capsys.readouterr().out
        found = pictures(tmp_path / f"a{ending}")
        assert len(found) == 10
        assert found[0].shape[0] in (240, 241)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.avi", "a.mp4"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--out", "a.gif"], "a film ends in .mp4 or .avi"),
        (["--out", "a.mp4", "--from-s", "50"], "nothing lies between"),
        (["--out", "a.mp4", "--camera"], "holds no pictures of the camera over the table"),
        (["--out", "no/such/a.mp4"], "there is no folder"),
    ],
)
def test_what_cannot_be_filmed_is_refused_in_one_sentence(words, sentence, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert call(["recording", "film", str(SOURCE), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert sentence in line
    assert not list(tmp_path.iterdir())


def test_pictures_of_the_camera_are_filmed_where_they_were_recorded(tmp_path):
    path = tmp_path / "camera.mcap"
    with Recorder(path, RecordingInfo(images=ImagePolicy.LOSSLESS)) as recorder:
        for number in range(5):
            shown = np.full((48, 64, 3), 50 * number, np.uint8)
            at_ns = number * 100_000_000
            image = OverheadImage(at_ns, "", 0, 48, 64, "bgr8", 192, shown.tobytes())
            envelope = Envelope(OverheadImage.TOPIC, "", number + 1, at_ns)
            recorder.record_encoded(OverheadImage, envelope, codec_of(OverheadImage).encode(image), at_ns)
    words = ["recording", "film", str(path), "--camera", "--fps", "10", "--out", str(tmp_path / "a.avi")]
    assert call(words) == 0
    brightness = [float(np.median(picture)) for picture in pictures(tmp_path / "a.avi")]
    assert np.allclose(brightness, [0, 50, 100, 150], atol=6)


def test_a_mock_up_is_drawn_to_scale_where_it_was(run):
    drawing = TablePicture(run, 700)
    x_low, x_high, *_ = run.rig.table_m
    picture = drawing.at(4.5)
    scale = drawing.size_px[0] / (x_high - x_low + 0.3)
    pose = pose_at(run.tracks["alpha"].truth, 4.5)
    u = (pose[0] - x_low + 0.15) * scale
    v = (run.rig.table_m[3] + 0.15 - pose[1]) * scale
    half_px = run.rig.half_width_m("alpha") * scale
    assert picture[round(v - 0.6 * half_px), round(u - 0.6 * half_px)].tolist() != [255, 255, 255]
    assert picture[round(v - 1.6 * half_px), round(u - 1.8 * half_px)].tolist() == [255, 255, 255]


def test_poses_between_rows_turn_the_short_way():
    rows = np.array([[0.0, 0.0, 0.0, 3.1], [1.0, 2.0, 4.0, -3.1]])
    assert pose_at(rows, 0.5) == pytest.approx([1.0, 2.0, math.pi], abs=1e-9)
    assert pose_at(rows, -0.1) is None
    assert pose_at(rows, 2.5) is None
    assert pose_at(rows[:0], 0.0) is None


def test_the_mode_is_the_last_one_before(run):
    track = run.tracks["alpha"]
    since_s, mode = track.modes[-1]
    assert mode_at(track, since_s + 0.01) == mode
    assert mode_at(track, -1.0) == "unknown"


def test_a_run_beside_itself_is_equal():
    found = compare_runs(SOURCE, SOURCE, installed_tables())
    assert {row.vehicle for row in found.figures} == {"alpha", "beta"}
    assert {row.change for row in found.figures if not math.isnan(row.first)} == {"equal"}
    assert [apart.rms_mm for apart in found.apart] == [0.0, 0.0]
    assert found.apart[0].sentence().startswith("alpha: over ")


@pytest.mark.parametrize(
    ("first", "second", "words"),
    [(2.0, 3.0, "+50.0 %"), (0.0, 3.0, "+3"), (1.0, 1.0, "equal"), (math.nan, 1.0, "")],
)
def test_a_change_is_said_in_words(first, second, words):
    assert Figure("alpha", "x_mm", first, second).change == words


def test_the_command_prints_figures_and_draws_the_page(tmp_path, capsys):
    out = tmp_path / "compared"
    assert call(["recording", "compare", str(SOURCE), str(SOURCE), "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "gas_ns" in shown
    assert "A: " in shown
    assert sorted(path.name for path in out.iterdir()) == ["report.html", "report.json"]


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("alpha/state.position_table_m[0]", "m"),
        ("alpha/imu.rate_body_rad_s", "rad/s"),
        ("alpha/wrench.torque_z_nm", "N m"),
        ("alpha/fix_account.nis", ""),
        ("alpha/imu.force_body_m_s2[1]", "m/s²"),
    ],
)
def test_units_are_read_from_names(name, unit):
    assert unit_of(name) == unit


def test_a_thinned_curve_keeps_every_spike():
    t_s = np.arange(100_000) * 1e-3
    values = np.zeros(100_000)
    values[54_321], values[77_777] = 9.0, -5.0
    values[10:20] = np.nan
    thin_s, thin = thinned(t_s, values)
    assert len(thin) <= 4000
    assert np.nanmax(thin) == 9.0
    assert np.nanmin(thin) == -5.0
    assert np.all(np.diff(thin_s) > 0)
