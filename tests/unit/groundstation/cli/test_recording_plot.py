"""``groundstation recording plot``: what it does not write to."""

from pathlib import Path

import pytest

from groundstation.cli.recording_plot import plot
from groundstation.declarations.errors import UsageError


@pytest.mark.parametrize("name", ["run.mcap", "plot.jpg", "plot"])
def test_a_picture_replaces_nothing_that_is_no_png(tmp_path: Path, name: str) -> None:
    recording, out = tmp_path / "run.mcap", tmp_path / name
    recording.write_bytes(b"a recording")
    with pytest.raises(UsageError, match=r"must end in \.png"):
        plot(recording, ["alpha/state.heading_rad"], out)
    assert recording.read_bytes() == b"a recording"
    assert out == recording or not out.exists()
