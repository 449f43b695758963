"""``groundstation relative``: tables out of files, and one sentence for whatever is wrong."""

import csv
import json
import re

import numpy as np
import pytest
from oracles import relative_pictures as pictures
from oracles import relative_scenes as scenes
from scipy.spatial.transform import Rotation

from groundstation.cli.relative_track import HEADER
from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError


@pytest.fixture
def call(groundstation):
    return lambda *words: groundstation("relative", *words)


def write_case(folder, scene, motion, rng, **more):
    labelled = more.get("labelled", True)
    rows = scenes.seen(scene, motion, rng, more.pop("clutter", 0.0), more.pop("missing", 0.0), labelled)
    (folder / "case.json").write_text(json.dumps(scene.case(**more)))
    lines = ["frame,t,marker,u,v", *(",".join(f"{x:.8g}" for x in row) for row in rows)]
    (folder / "pixels.csv").write_text("\n".join(lines) + "\n")
    return folder / "case.json", folder / "pixels.csv"


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture
def small(tmp_path, rng):
    """Twelve labelled frames."""
    motion = scenes.leaving(3, np.arange(0.0, 48.0, 4.0))
    return (
        *write_case(tmp_path, scenes.Scene(), motion, rng, guess_frame0=scenes.guess(motion, rng)),
        motion,
    )


@pytest.mark.parametrize(
    "words", [(), ("--motion-model", "none"), ("--motion-model", "none", "--solver", "newton")], ids=str
)
def test_every_frame_gets_a_row_in_the_columns_of_the_format(call, small, tmp_path, words):
    case, pixels, motion = small
    out = tmp_path / "poses.csv"
    call("track", case, "--pixels", pixels, "--out", out, *words)
    assert out.read_text().startswith(HEADER)
    rows = read(out)
    assert [row["frame"] for row in rows] == [str(i) for i in range(12)]
    assert {row["status"] for row in rows} == {"solved"}
    for row, rotation, position in zip(rows, motion.rotations, motion.positions_m, strict=True):
        q = np.array([float(row[f"q{i}"]) for i in (1, 2, 3, 0)])
        off = np.array([float(row[k]) for k in "xyz"]) - position
        assert np.linalg.norm(off) < 6.0 * float(row["std_pos_m"])
        angle = np.degrees((Rotation.from_quat(q) * rotation.inv()).magnitude())
        assert angle < 6.0 * float(row["std_att_deg"])
        assert float(row["ms"]) > 0.0


def test_a_target_file_may_be_toml(call, small, tmp_path):
    case, pixels, _ = small
    keys = json.loads(case.read_text())
    camera = keys["camera"]
    lines = [f"{key} = {json.dumps(keys[key])}" for key in ("points_m", "sigma_px", "labelled", "inertia")]
    lines += ["[camera]", *(f"{key} = {value}" for key, value in camera.items())]
    (tmp_path / "target.toml").write_text("\n".join(lines))
    call("track", tmp_path / "target.toml", "--pixels", pixels, "--out", tmp_path / "poses.csv")
    assert {row["status"] for row in read(tmp_path / "poses.csv")} == {"solved"}


def test_frames_that_show_too_little_are_propagated_with_growing_sigma(call, small, tmp_path):
    case, pixels, _ = small
    lines = pixels.read_text().splitlines()
    few = [line for line in lines if line.split(",")[0] not in ("8", "9", "10", "11")]
    few += [
        line
        for line in lines
        if line.split(",")[0] in ("8", "10", "11") and line.split(",")[2] in ("0", "3", "5")
    ]
    pixels.write_text("\n".join(few) + "\n")
    call("track", case, "--pixels", pixels, "--out", tmp_path / "poses.csv")
    rows = read(tmp_path / "poses.csv")
    assert [row["status"] for row in rows] == ["solved"] * 8 + ["propagated"] * 4
    sigmas = [float(row["std_pos_m"]) for row in rows[7:]]
    assert sigmas == sorted(sigmas)
    assert sigmas[-1] > 2.0 * sigmas[0]
    assert rows[9]["t"] == "36"  # of frame 9 nothing was seen at all: between its neighbours


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points_m": None}, "points_m"),
        ({"points_m": [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]}, "one line"),
        ({"points_m": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]]}, "points 1 and 3"),
        ({"inertia": [1.0, 1.0, 3.0]}, "of no body"),
        ({"camera": {"f_px": -3, "cx": 1, "cy": 1, "width": 640, "height": 480}}, "f_px"),
        ({"guess_frame0": {"q": [1, 1, 1, 1], "t": [0, 0, 3]}}, "length 1"),
        ({"guess_frame0": {"q": [1, 0, 0, 0], "t": [0, 0, -3]}}, "in front"),
        ({"sigma_px": -1}, "sigma_px"),
    ],
    ids=str,
)
def test_a_case_that_is_wrong_is_refused_in_one_sentence(call, small, tmp_path, change, words):
    case, pixels, _ = small
    keys = json.loads(case.read_text()) | change
    case.write_text(json.dumps({key: value for key, value in keys.items() if value is not None}))
    with pytest.raises(FileError, match=words) as error:
        call("track", case, "--pixels", pixels, "--out", tmp_path / "poses.csv")
    assert str(case) in str(error.value)
    assert not (tmp_path / "poses.csv").exists()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda text: text.replace("marker", "name", 1), "marker"),
        (lambda text: text + "12,48,9,1.0,2.0\n", "marker 9"),
        (lambda text: text + "11,99,0,1.0,2.0\n", "frame 11"),
        (lambda text: text + "12,3,0,1.0,2.0\n", "not after"),
        (lambda text: text + "11,44,0,1.0,2.0\n", "twice"),
        (lambda text: text.splitlines()[0] + "\n", "no "),
        (lambda text: text + "12,48,0,nan,2.0\n", "line"),
        (lambda text: text + "12,48,0,1e7,2.0\n", r"u is 1e\+07, expected at most 1e\+06\.$"),
    ],
)
def test_pixels_that_are_wrong_are_refused_in_one_sentence(call, small, tmp_path, spoil, words):
    case, pixels, _ = small
    pixels.write_text(spoil(pixels.read_text()))
    with pytest.raises(FileError, match=words):
        call("track", case, "--pixels", pixels, "--out", tmp_path / "poses.csv")
    assert not (tmp_path / "poses.csv").exists()


def test_words_that_are_none_of_the_tables_are_refused(call, small, tmp_path):
    case, pixels, _ = small
    for words in (("--solver", "magic"), ("--motion-model", "magic")):
        with pytest.raises(UsageError, match="must be one of"):
            call("track", case, "--pixels", pixels, "--out", tmp_path / "poses.csv", *words)
    with pytest.raises(UsageError, match="--pixels"):
        call("track", case, "--out", tmp_path / "poses.csv")


def test_centroids_of_an_archive(call, tmp_path, rng):
    pixels, radii = pictures.tips(scenes.Scene(), Rotation.identity(), np.array([0, 0, 6.0]), 0.024)
    frames = np.stack([pictures.paint(pixels, radii, rng) for _ in range(2)])
    np.savez(tmp_path / "frames.npz", frames=frames)
    for method in ("grey", "contour"):
        call("centroids", tmp_path / "frames.npz", "--out", tmp_path / "c.csv", "--method", method)
        rows = read(tmp_path / "c.csv")
        assert [row["frame"] for row in rows] == ["0"] * 6 + ["1"] * 6
        found = np.array([[float(row["u"]), float(row["v"])] for row in rows[:6]])
        assert np.linalg.norm(found[:, None] - pixels[None], axis=2).min(axis=1).max() < 0.4


def save_array(path, array):
    with path.open("wb") as file:
        np.save(file, array)


def save_frames(path):
    np.savez_compressed(path, frames=np.arange(2 * 48 * 64, dtype=np.uint8).reshape(2, 48, 64))


def damage(path):
    data = bytearray(path.read_bytes())
    data[60:90] = bytes(30)
    path.write_bytes(data)


@pytest.mark.parametrize(
    ("save", "words"),
    [
        (lambda p: p.write_bytes(b""), r"is no \.npz: store frames by numpy\.savez"),
        (lambda p: p.write_text("plain words\n"), r"is no \.npz: store frames by numpy\.savez"),
        (lambda p: save_array(p, np.zeros((2, 48, 64), np.uint8)), r"is a single array \(\.npy\)"),
        (lambda p: np.savez(p, frames=np.array([{}])), r"is a damaged \.npz, or holds objects"),
        (lambda p: (save_frames(p), damage(p)), r"is a damaged \.npz, or holds objects"),
        (lambda p: np.savez(p, other=np.zeros((2, 48, 64), np.uint8)), "no array 'frames'"),
        (lambda p: np.savez(p, frames=np.zeros((2, 48, 64))), "8-bit"),
        (lambda p: np.savez(p, frames=np.zeros((48, 64), np.uint8)), "shape"),
        (lambda p: np.savez(p, frames=np.zeros((0, 48, 64), np.uint8)), "no picture"),
    ],
)
def test_archives_that_are_none_are_refused(call, tmp_path, save, words):
    save(tmp_path / "frames.npz")
    with pytest.raises(FileError, match=words) as refused:
        call("centroids", tmp_path / "frames.npz", "--out", tmp_path / "c.csv")
    assert str(refused.value).count("frames.npz") == 1
    assert "pickle" not in str(refused.value)
    assert not (tmp_path / "c.csv").exists()


def _stage_and_runs(folder):
    stage = {"In": 2.0, "Ix": 1.0, "markers_m": np.eye(3).tolist(), "f_px": 600.0, "camera": "at (4+t,0,0)"}
    (folder / "stage.json").write_text(json.dumps(stage))
    rows = [f"0,{t},{k},{t + k},{k}" for t in range(2) for k in range(3)]
    (folder / "runs.csv").write_text("\n".join(["run,t,marker,u,v", *rows]) + "\n")


@pytest.mark.parametrize(
    "words",
    [
        ("centroids", "frames.npz", "--out", "frames.npz"),
        ("centroids", "frames.npz", "--out", "c.csv", "--sigma", "frames.npz"),
        ("centroids", "frames.npz", "--out", "c.csv", "--sigma", "c.csv"),
        ("track", "case.json", "--pixels", "pixels.csv", "--out", "pixels.csv"),
        ("track", "case.json", "--pixels", "pixels.csv", "--out", "case.json"),
        ("track", "--target", "case.json", "--pixels", "pixels.csv", "--out", "case.json"),
        ("track", "case.json", "--pixels", "pixels.csv", "--out", "x.csv", "--rates", "x.csv"),
        ("track", "case.json", "--pixels", "pixels.csv", "--out", "x.csv", "--rates", "pixels.csv"),
        ("track", "case.json", "--video", "frames.npz", "--out", "frames.npz"),
        ("track", "case.json", "--video", "frames", "--out", "frames/0.png"),
        ("track", "case.json", "--video", "film.avi", "--out", "x.csv", "--annotated", "film.avi"),
        ("track", "case.json", "--video", "film.avi", "--out", "x.html", "--review", "x.html"),
        ("track", "case.json", "--pixels", "pixels.csv", "--out", "linked.csv"),
        ("spin", "stage.json", "--pixels", "runs.csv", "--out", "runs.csv"),
        ("spin", "stage.json", "--pixels", "runs.csv", "--out", "stage.json"),
        ("target", "frames/0.png", "--out", "frames/0.png"),
        ("tle", "two.txt", "--out", "two.txt"),
        ("tle", "two.txt", "other.txt", "--out", "other.txt"),
    ],
    ids=" ".join,
)
def test_nothing_is_written_over_what_is_read_nor_twice(call, small, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    save_frames(tmp_path / "frames.npz")
    _stage_and_runs(tmp_path)
    (tmp_path / "frames").mkdir()
    (tmp_path / "linked.csv").hardlink_to("pixels.csv")
    for name in ("film.avi", "two.txt", "other.txt", "frames/0.png"):
        (tmp_path / name).write_bytes(b"never looked at")
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    with pytest.raises(FileError, match=r"is a file that is read: give|is to be written twice: give"):
        call(*words)
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before


SPOILT = {
    "empty": b"",
    "words": b"plain words, no more\n",
    "binary": bytes(range(256)) * 4,
    "workbook": b"PK\x03\x04" + bytes(60),
    "array": b"\x93NUMPY\x01\x00" + bytes(60),
    "json of something else": b'{"a": 1}',
    "list": b"[1, 2",
    "latin": "Gr\xf6\xdfe\n".encode("latin-1"),
}


@pytest.mark.parametrize("spoilt", SPOILT)
@pytest.mark.parametrize(
    "words",
    [
        "track SPOILT.json --pixels pixels.csv --out out.csv",
        "track SPOILT.toml --pixels pixels.csv --out out.csv",
        "track case.json --pixels SPOILT.csv --out out.csv",
        "track case.json --video SPOILT.npz --out out.csv",
        "track case.json --video SPOILT.avi --out out.csv",
        "centroids SPOILT.npz --out out.csv",
        "spin SPOILT.json --pixels runs.csv --out out.csv",
        "spin stage.json --pixels SPOILT.csv --out out.csv",
        "target SPOILT.png --out out.html",
        "tle SPOILT.txt --out out.csv",
        "tle SPOILT.txt SPOILT.txt --out out.csv",
    ],
)
def test_whatever_a_file_holds_it_is_named_once_in_one_sentence(
    call, small, tmp_path, monkeypatch, words, spoilt
):
    monkeypatch.chdir(tmp_path)
    _stage_and_runs(tmp_path)
    (spoilt_name,) = {word for word in words.split() if word.startswith("SPOILT")}
    (tmp_path / spoilt_name).write_bytes(SPOILT[spoilt])
    with pytest.raises(FileError) as refused:
        call(*words.split())
    sentence = str(refused.value)
    assert sentence.count(spoilt_name) == 1
    assert sentence.startswith(f"{spoilt_name}: ")
    assert re.search(r"[^.)]\.$|[^.]\)\.$", sentence)
    assert ".)." not in sentence
    assert "pickle" not in sentence
    assert not list(tmp_path.glob("out.*"))
