"""Every model that a rig names is made from bytes as it is from its file, so that a rig reads a file once."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes
from groundstation.fusion.constants_file import parse_constants, read_constants
from groundstation.fusion.table_map import MapProvenance, TableMap
from groundstation.overhead.liveries import load_liveries, parse_liveries
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.stamp_delay import parse_delay, read_delay
from groundstation.star_tracking.star_catalogue import StarCatalogue

RIG = Path(__file__).parents[4] / "calibration" / "rigs" / "emulated"
DELAY = '[delay]\nvalue = 0.05\nstd = 0.003\nunit = "s"\n[jitter]\nvalue = 0.004\nunit = "s"\n'
CONSTANTS = '[gyro_scale]\nvalue = 0.01\nstd = 0.001\nunit = "1"\n'


@pytest.fixture
def folder(tmp_path):
    for path in RIG.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    (tmp_path / "delay.toml").write_text(DELAY)
    (tmp_path / "constants.toml").write_text(CONSTANTS)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "load", "parse"),
    [
        ("camera.json", CameraCalibration.load, CameraCalibration.parse),
        ("overhead_camera.json", OverheadCamera.load, OverheadCamera.parse),
        ("circles.toml", load_liveries, parse_liveries),
        ("delay.toml", read_delay, parse_delay),
        ("constants.toml", lambda path: read_constants([path]), parse_constants),
    ],
)
def test_bytes_give_what_the_file_gives_and_a_refusal_names_it(folder, name, load, parse):
    path = folder / name
    data = path.read_bytes()
    assert parse(data, path) == load(path)
    assert parse(b"\xef\xbb\xbf" + data.replace(b"\n", b"\r\n"), path) == load(path)
    with pytest.raises(FileError, match=f"^nowhere/{name}: "):
        parse(b"\xff" + data, Path("nowhere") / name)
    with pytest.raises(FileError, match=f"^nowhere/{name}: cannot be read"):
        load(Path("nowhere") / name)


def test_a_star_list_may_come_from_a_spreadsheet(folder):
    path = folder / "ceiling.csv"
    want = StarCatalogue.load(path)
    text = path.read_text().replace(",", ";").replace(".", ",").replace("\n", "\r\n")
    found = StarCatalogue.parse(b"\xef\xbb\xbf" + text.encode(), Path("x"))
    assert found.ids == want.ids
    for name in ("x_m", "y_m", "sigma_m"):
        np.testing.assert_array_equal(getattr(found, name), getattr(want, name))


def test_a_table_map_asks_its_reader_for_the_grid(tmp_path):
    grid = np.arange(6.0).reshape(2, 3)
    provenance = MapProvenance(datetime(2026, 1, 2, tzinfo=UTC), {"laps.mcap": "0" * 64}, 1.0, 60.0)
    made = TableMap(
        0.0, 0.0, 0.5, grid, grid, grid, grid, grid, (1e-3, 0.0), np.eye(2) * 1e-8, 1e-3, provenance
    )
    made.save(tmp_path / "map.toml")
    read: list[str] = []

    def reader(path: Path) -> bytes:
        read.append(path.name)
        return read_bytes(path)

    path = tmp_path / "map.toml"
    found = TableMap.parse(path.read_bytes(), path, reader)
    assert read == ["map.npz"]
    np.testing.assert_array_equal(found.ax_m_s2, grid)
