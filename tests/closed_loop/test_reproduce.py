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
