"""Every JSON and TOML file that a person hands over: each number of it replaced by what no file can mean."""

import re
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from firmware_emulator.overhead.scene import read_markings, read_overhead_camera
from firmware_emulator.side_view.scene import read_hulls, read_side_camera
from firmware_emulator.sky.scene import read_camera
from groundstation.data_sets.known_block import read_known
from groundstation.files.errors import FileError
from groundstation.fusion.constants_file import read_constants
from groundstation.fusion.table_map import MapProvenance, TableMap
from groundstation.overhead.liveries import load_liveries
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.relative_navigation.side_bodies import load_side_bodies
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.stamp_delay import read_delay
from tests.contract.test_tables_of_people import KNOWN

RIG = Path(__file__).parents[2] / "calibration" / "rigs" / "emulated"
DELAY = '[delay]\nvalue = 0.05\nstd = 0.003\nunit = "s"\n[jitter]\nvalue = 0.004\nunit = "s"\n'
CONSTANTS = '[gyro_scale]\nvalue = 0.01\nstd = 0.001\nunit = "1"\n'
META = '{"known": ' + repr(KNOWN).replace("'", '"') + "}"


def _map_text(folder):
    grid = np.arange(6.0).reshape(2, 3)
    origin = MapProvenance(datetime(2026, 1, 2, tzinfo=UTC), {"laps.mcap": "0" * 64}, 1.0, 60.0)
    mean = (1e-3, 0.0)
    TableMap(0.0, 0.0, 0.5, grid, grid, grid, grid, grid, mean, np.eye(2) * 1e-8, 1e-3, origin).save(
        folder / "map.toml"
    )
    return (folder / "map.toml").read_text()


FILES = {
    "camera.json": (lambda _: (RIG / "camera.json").read_text(), CameraCalibration.load),
    "overhead_camera.json": (lambda _: (RIG / "overhead_camera.json").read_text(), OverheadCamera.load),
    "circles.toml": (lambda _: (RIG / "circles.toml").read_text(), load_liveries),
    "side_camera.json": (lambda _: (RIG / "side_camera.json").read_text(), SideCamera.load),
    "side_bodies.toml": (lambda _: (RIG / "side_bodies.toml").read_text(), load_side_bodies),
    "delay.toml": (lambda _: DELAY, read_delay),
    "constants.toml": (lambda _: CONSTANTS, lambda path: read_constants([path])),
    "map.toml": (_map_text, TableMap.load),
    "meta.json": (lambda _: META, read_known),
    "camera.json of the emulator": (lambda _: (RIG / "camera.json").read_text(), read_camera),
    "overhead camera of the emulator": (
        lambda _: (RIG / "overhead_camera.json").read_text(), read_overhead_camera,
    ),
    "side camera of the emulator": (
        lambda _: (RIG / "side_camera.json").read_text(), read_side_camera,
    ),
    "hulls of the emulator": (lambda _: (RIG / "side_bodies.toml").read_text(), read_hulls),
    "circles of the emulator": (lambda _: (RIG / "circles.toml").read_text(), read_markings),
}  # fmt: skip
NUMBER = re.compile(r"(?<=[=:\[,] )-?\d+(?:\.\d+)?(?:e-?\d+)?(?=[,\]}\n ])|(?<=\[)-?\d+\.\d+(?=[,\]])")
WILD = {
    "hundreds of digits": "9" * 400,
    "thousands of digits": "9" * 5000,
    "a list": "[[[1]]]",
    "a long text": '"' + "x" * 5000 + '"',
    "nested deeply": "[" * 100_000 + "]" * 100_000,
}


def _is_for_people(text, place):
    """Comments, and what a map repeats for those who read it: nothing is made from it."""
    line = text[text.rfind("\n", 0, place) + 1 :].partition("\n")[0]
    section = text[:place].rpartition("\n[")[2].partition("]")[0]
    return (
        line.startswith("#")
        or (section.startswith("mean.") and line.startswith("std"))
        or (section == "mean.uphill_gradient")
    )


@pytest.mark.parametrize("wild", WILD)
@pytest.mark.parametrize("name", FILES)
def test_every_number_of_every_file_is_refused_in_a_sentence_when_it_is_none(name, wild, tmp_path):
    text_of, read = FILES[name]
    text = text_of(tmp_path)
    path = tmp_path / "map.toml" if name == "map.toml" else tmp_path / "given"
    found = [match for match in NUMBER.finditer(text) if not _is_for_people(text, match.start())]
    assert len(found) >= 2
    path.write_text(text)
    read(path)
    for match in found:
        path.write_text(text[: match.start()] + WILD[wild] + text[match.end() :])
        with pytest.raises(FileError) as refused:
            read(path)
        sentence = str(refused.value)
        assert sentence.startswith(str(path)), sentence
        assert "\n" not in sentence
        assert len(sentence) < 400, sentence
