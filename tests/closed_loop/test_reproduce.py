"""A study of the published experiments is flown, drawn and judged."""

import json

import pytest

from groundstation.recording.reader import Recording


@pytest.mark.slow
def test_the_zero_offset_study_finds_what_the_rest_was_disturbed_by(groundstation, tmp_path):
    groundstation("reproduce", "air-table", "--out", tmp_path, "--figure", "18")
    rows = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    found = {row["quantity"]: row for row in rows}
    assert found["alpha over 10 s, m/s^2"]["ours"] == pytest.approx(0.005, rel=0.15)
    assert found["beta over 10 s, m/s^2"]["ours"] == pytest.approx(-0.004, rel=0.15)
    assert found["alpha with the printed sign, m/s^2"]["ours"] == -found["alpha over 10 s, m/s^2"]["ours"]
    assert found["worse over 20 s than over 10 s, times"]["ours"] > 3.0
    assert "does not come out" not in (tmp_path / "report.html").read_text(encoding="utf-8")
    recordings = sorted(path.name for path in (tmp_path / "flights").iterdir())
    assert recordings == ["pulses_default.mcap", "pulses_published.mcap"]
    with Recording(tmp_path / "flights" / recordings[1]) as recording:
        assert 'identification = "published"' in recording.info.rig_toml


@pytest.mark.slow
@pytest.mark.parametrize(
    ("study", "figure", "words"),
    [
        ("chibis", "2.12", "position error at 13.5 to 15 m, m rms"),
        ("chibis", "3.6", "length of the rate by video, deg/s"),
        ("differential-evolution", "2", "mean error of psi, 30 s, rad"),
    ],
)
def test_figures_of_relative_navigation_are_made_from_the_installed_emulator(
    groundstation, tmp_path, study, figure, words
):
    groundstation("reproduce", study, "--out", tmp_path, "--figure", figure)
    rows = json.loads((tmp_path / "results.json").read_text(encoding="utf-8"))
    (row,) = [row for row in rows if row["quantity"] == words]
    assert row["ours"] > 0.0
    assert row["assumed"]
    assert not (tmp_path / "flights").exists()
