"""A rig file is read once with every file that it names; a mistake is one sentence with file and key."""

import hashlib
import tomllib
from pathlib import Path

import pytest

from groundstation.declarations.errors import RigError
from groundstation.parts.stars.sections import StarsOfType
from groundstation.rig.plan import make_node, nodes_of
from groundstation.rig.provenance import file_hashes, portable, recording_info
from groundstation.rig.read import build_rig, bytes_of, files_of, load_rig, parse_rig, read_text
from groundstation.star_tracking.camera_model import CameraCalibration

ROOT = Path(__file__).parents[4]
RIGS = sorted((ROOT / "examples" / "rigs").glob("*.toml"))
STARS = ROOT / "examples" / "rigs" / "two_mock_ups.toml"
DRAWN = ROOT / "examples" / "rigs" / "drawn_fixes.toml"
KEY = "mock_ups.standard.star_camera.camera"


@pytest.fixture
def reads(monkeypatch):
    """Paths of all files that are read, in order."""
    found = []
    real = Path.open

    def opened(self, mode="r", *more, **options):
        is_core = self.resolve().is_relative_to(ROOT / "groundstation")  # looks at its sources
        if "b" in mode and not is_core:
            found.append(self.resolve())
        return real(self, mode, *more, **options)

    monkeypatch.setattr(Path, "open", opened)
    return found


@pytest.mark.parametrize("path", RIGS, ids=lambda path: path.stem)
def test_every_file_is_read_once_and_making_the_nodes_reads_none(path, reads):
    text = read_text(path)
    reads.clear()
    rig = parse_rig(text, path)
    named = sorted({file.path.resolve() for file in files_of(rig).values()})
    assert sorted(reads) == named
    for placed in nodes_of(rig):
        make_node(rig, placed.key)
    assert sorted(reads) == named


def test_a_file_that_two_keys_name_is_read_once(tmp_path, reads):
    constants = tmp_path / "joint.toml"
    constants.write_text('[gyro_scale]\nvalue = 0.004\nstd = 0.0001\nunit = "1"\n')
    text = DRAWN.read_text()
    text = text.replace("baud = 250000", 'baud = 250000\ncalibration = ["joint.toml", "joint.toml"]')
    rig = parse_rig(text, tmp_path / "rig.toml")
    first, second = (files_of(rig)[f"mock_ups.standard.imu.calibration.{n}"] for n in (0, 1))
    assert first is second
    assert reads == [constants.resolve()]


def test_files_have_their_keys_bytes_and_hashes():
    rig = load_rig(STARS)
    file = files_of(rig)[KEY]
    assert file.data == file.path.read_bytes()
    assert file_hashes(rig)[KEY] == hashlib.sha256(file.data).hexdigest()
    info = recording_info(rig, STARS.read_text(), STARS, 3, None)
    assert info.calibration_sha256 == file_hashes(rig)
    assert info.rig_path == portable(STARS)


def test_a_rig_file_is_recorded_relative_to_the_working_directory_if_it_lies_below(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert portable(Path("rigs") / ".." / "rigs" / "my.toml") == "rigs/my.toml"
    assert portable(tmp_path / "my.toml") == "my.toml"
    assert portable(STARS) == str(STARS.resolve())


def test_what_a_run_was_handed_is_used_in_place_of_the_disk(tmp_path, reads):
    given = bytes_of(load_rig(STARS))
    reads.clear()
    text = STARS.read_text()
    rig = parse_rig(text, STARS, given)
    assert reads == []
    assert file_hashes(rig) == file_hashes(load_rig(STARS))


def test_what_flies_is_what_was_handed_over_even_where_the_file_has_changed_since(tmp_path):
    folder = tmp_path / "calibration"
    text = STARS.read_text()
    for file in files_of(load_rig(STARS)).values():
        copy = folder / file.path.relative_to(file.path.parents[2])
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_bytes(file.data)
    path = tmp_path / "rig.toml"
    text = text.replace("../../calibration/", "calibration/")
    path.write_text(text)
    given = bytes_of(load_rig(path))
    assert given
    for name in given:
        Path(name).write_bytes(b"something else")
    rig = parse_rig(text, path, given)
    lens = rig.of_type("alpha", StarsOfType).star_camera.camera
    assert lens.data == given[str(lens.path)]
    assert lens.value(CameraCalibration.parse).width > 0
    for placed in nodes_of(rig):
        make_node(rig, placed.key)
    with pytest.raises(RigError):
        parse_rig(text, path)  # from the disk


def test_a_file_that_was_not_handed_over_is_not_taken_from_the_disk(reads):
    given = bytes_of(load_rig(STARS))
    missing = next(name for name in given if name.endswith("/camera.json"))
    del given[missing]
    reads.clear()
    with pytest.raises(RigError, match=f"{KEY}: .*camera.json: was not among the files of the run"):
        parse_rig(STARS.read_text(), STARS, given)
    assert reads == []


def test_a_file_that_is_not_there_is_one_sentence_with_file_and_key(tmp_path):
    text = STARS.read_text().replace("../../calibration", str(ROOT / "calibration"))
    text = text.replace("emulated/camera.json", "emulated/nowhere.json")
    assert "nowhere" in text
    with pytest.raises(RigError) as refused:
        parse_rig(text, tmp_path / "rig.toml")
    sentence = str(refused.value)
    assert sentence.startswith(f"{tmp_path / 'rig.toml'}: {KEY}: ")
    assert "nowhere.json: cannot be read (No such file or directory)" in sentence
    assert "\n" not in sentence


def test_a_file_that_says_something_impossible_is_refused_when_the_rig_is_read(tmp_path):
    (tmp_path / "torn.json").write_text("{")
    text = STARS.read_text().replace("../../calibration", str(ROOT / "calibration"))
    text = text.replace(str(ROOT / "calibration/rigs/emulated/camera.json"), "torn.json")
    with pytest.raises(RigError) as refused:
        parse_rig(text, tmp_path / "rig.toml")
    assert str(refused.value).startswith(str(tmp_path / "torn.json"))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("given", [5, True, ["a.toml"], {"path": "a.toml"}])
def test_a_path_that_is_none_is_refused_by_its_key(given, tmp_path):
    content = tomllib.loads(DRAWN.read_text())
    content["table"]["map"] = given
    with pytest.raises(RigError, match=r"rig.toml: table.map: expected the path of a file"):
        build_rig(content, tmp_path / "rig.toml")


def test_a_rig_file_may_begin_with_a_mark_of_the_byte_order_and_end_lines_as_windows_does(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_bytes(b"\xef\xbb\xbf" + DRAWN.read_bytes().replace(b"\n", b"\r\n"))
    assert load_rig(path).name == load_rig(DRAWN).name


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "there is no such rig file"),
        (b"\xff\xfe\x00", r"is not a text file \(line 1 is no UTF-16\)"),
        (b"name = ", "is not valid TOML"),
        (b"", "'name' is missing"),
        (b"x = " + b"[" * 5000, "is nested deeper than 64 levels"),
    ],
)
def test_what_is_no_rig_file_is_one_sentence(tmp_path, content, sentence):
    path = tmp_path / "rig.toml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(RigError, match=sentence) as refused:
        load_rig(path)
    assert str(refused.value).startswith(str(path))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('mock_up = "standard"', 'mock_up = "big"', "vehicles.alpha.mock_up: 'big' is not among mock_ups"),
        ("x_m = 0.2", "x_m = 1.9", "vehicles.alpha.hold: (1.9, 0.1) m is nearer than 0.2 m"),
        ("x_min_m = -2.0", "x_min_m = 1.9", "table: x_min_m = 1.9 and x_max_m = 2 leave no room"),
        (
            "x_min_m = -2.0",
            'x_min_m = -2.0\nkeep_out = [{ name = "lamp", x_m = 0.3, y_m = 0.1, radius_m = 0.1 }]',
            "vehicles.alpha.hold: lamp is 0.10 m from there, 0.325 m are asked for",
        ),
        (
            "x_min_m = -2.0",
            'x_min_m = -2.0\nkeep_out = [{ name = "lamp", x_m = 0.3, y_m = 0.1 }]',
            "'table.keep_out.0.radius_m' is missing",
        ),
        (
            "x_min_m = -2.0",
            'x_min_m = -2.0\nkeep_out = [{ name = "lamp", x_m = 1.5, y_m = 0.1, radius_m = 0.1 }, '
            '{ name = "lamp", x_m = 1.2, y_m = 1.1, radius_m = 0.1 }]',
            "table: keep_out: two places are called 'lamp'",
        ),
        ("baud = 250000", "baud = 9600", "mock_ups.standard.imu.baud: "),
        ("bus_index", "bus_idx", "'vehicles.alpha.bus_idx' is no known key (a typo?)"),
        ("[vehicles.alpha]", "[vehicles.Alpha]", "vehicles.Alpha: "),
        (
            "hold = { x_m = 0.2, y_m = 0.1, heading_deg = 0.0 }",
            "hold = [0.2, 0.1, 0.0]",
            "vehicles.alpha.hold: expected a table of keys, found [0.2, 0.1, 0.0]",
        ),
        (
            "[vehicles.alpha]\n",
            '[vehicles.alpha]\ncontrol = { controller = "path", parameters = { waypoints_m = [] } }\n',
            "vehicles.alpha.control.parameters: waypoints_m: shape = 'waypoints' needs at least one",
        ),
    ],
)
def test_a_mistake_is_one_sentence_with_file_and_key(tmp_path, old, new, sentence):
    text = DRAWN.read_text()
    assert old in text
    path = tmp_path / "rig.toml"
    with pytest.raises(RigError) as refused:
        parse_rig(text.replace(old, new, 1), path)
    assert str(refused.value).startswith(f"{path}: {sentence}")
    assert "\n" not in str(refused.value)


TWO = DRAWN.parent / "two_mock_ups.toml"


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("x_m = -0.5, y_m = 0.1", "the hold pose of alpha is 0.00 m from there, 0.45 m are asked for"),
        ("x_m = -0.5, y_m = 0.54", "the hold pose of alpha is 0.44 m from there, 0.45 m are asked for"),
    ],
)
def test_two_that_would_hold_too_near_to_each_other_are_refused_with_the_distance(place, words):
    text = TWO.read_text()
    old = "x_m = 0.6, y_m = -0.1"
    assert text.count(old) == 1
    with pytest.raises(RigError) as refused:
        parse_rig(text.replace(old, place), TWO)
    assert str(refused.value) == f"{TWO}: vehicles.beta.hold: {words}"
    parse_rig(text.replace(old, "x_m = -0.5, y_m = 0.56"), TWO)


def test_who_follows_another_may_have_a_hold_pose_anywhere_on_the_table():
    text = TWO.read_text().replace("x_m = 0.6, y_m = -0.1", "x_m = -0.5, y_m = 0.1")
    text += """
[vehicles.beta.control]
controller = "formation"
parameters = { neighbours = { alpha = { offset_m = [0.6, 0.0] } } }
"""
    assert parse_rig(text, TWO).vehicles["beta"].hold.x_m == -0.5
