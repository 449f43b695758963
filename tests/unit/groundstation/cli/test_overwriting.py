"""No command writes over what it reads, nor two results into one file; it says so before any work."""

import pytest

from groundstation.files.errors import FileError

FILES = (
    *("set/imu.csv", "set/stars.csv", "set/meta.json", "set/camera.json", "set/ceiling.csv"),
    *("set/anchors.csv", "set/places.csv", "set/mock_ups.toml", "set/frames/1.png"),
    *("a.mcap", "b.mcap", "map.toml", "map.npz", "rig.toml", "rig.json", "tilts.csv", "camera.json"),
    *("ceiling.csv", "plot.png", "film.mp4", "run/recording.mcap"),
)
READ = [
    "fusion run set --out set/stars.csv",
    "fusion run set --table-map map.toml --out map.toml",
    "fusion run set --out set/a.csv --plot set/a.csv",
    "star-tracker solve set --out set/camera.json",
    "star-tracker solve set --out set/frames/1.png",
    "star-tracker solve set --out a.csv --plot set/frames/1.png",
    "star-tracker solve set --out a.csv --pictures set/frames",
    "star-tracker overhead set --out set/mock_ups.toml",
    "star-tracker survey set --out set/anchors.csv",
    "star-tracker survey set --out sky.csv --camera-out set/camera.json",
    "recording plot plot.png x --out plot.png",
    "recording film film.mp4 --out film.mp4",
    "recording film run --out run/recording.mcap",
    "calibrate zero-offset set --out set/meta.json",
    "calibrate zero-offset a.mcap --out a.mcap",
    "calibrate zero-offset-fit a.mcap --start-s 1 --end-s 2 --out a.mcap",
    "calibrate temperature a.mcap --out a.mcap",
    "calibrate gyro-scale a.mcap --out a.toml --plot a.mcap",
    "calibrate allan a.mcap --out a.mcap",
    "calibrate joint set --out a.toml --table-map set/imu.csv",
    "calibrate joint set --out a.toml --table-map a.toml",
    "calibrate joint set --out a.npz --table-map a.toml",
    "calibrate tilt a.mcap b.mcap --out b.mcap",
    "calibrate tilt a.mcap --tilts tilts.csv --out tilts.csv",
    "calibrate tilt a.mcap --table-map map.toml --out map.toml",
    "calibrate table-map a.mcap --check b.mcap --out b.mcap",
    "calibrate table-map a.mcap --rig rig.toml --out rig.toml",
    "calibrate table-map a.mcap --out map.toml --plot map.npz",
    "calibrate laboratory a.mcap --rig rig.toml --out rig.toml",
    "calibrate laboratory a.mcap --out rig.toml --plot rig.json",
    "calibrate amend ceiling.csv a.mcap --out ceiling.csv",
    "calibrate amend a.toml a.mcap --out a.csv",
    "calibrate survey set --out set/camera.json",
    "calibrate lens set --out a.toml --camera-out set/camera.json",
    "calibrate mount set --out set/ceiling.csv",
    "calibrate board set --out set/frames/1.png",
    "calibrate board set --camera camera.json --out a.toml --camera-out camera.json",
    "calibrate delay set --out set/imu.csv",
    "calibrate overhead set --out a.toml --camera-out set/camera.json",
    "calibrate overhead set --out set/places.csv",
]


@pytest.mark.parametrize("words", READ)
def test_nothing_is_written_over_what_is_read_nor_twice(groundstation, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    for name in FILES:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"never looked at")
    with pytest.raises(
        FileError, match=r"is a (file|folder) that is read: give|is to be written twice: give"
    ):
        groundstation(*words.split())
    assert sorted(
        str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()
    ) == sorted(FILES)
    assert {path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == {b"never looked at"}
