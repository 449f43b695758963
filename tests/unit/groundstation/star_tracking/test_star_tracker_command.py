"""``groundstation star-tracker``: tables out of folders, and one sentence for whatever is wrong."""

import csv
import json
import tomllib

import cv2
import numpy as np
import pytest

from groundstation.cli.star_tracker import COLUMNS
from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError

POSES = ((2.0, 1.8, 0.5), (2.6, 2.1, -2.0))


@pytest.fixture(scope="module")
def ceiling_folder(tmp_path_factory, painter):
    """Two good pictures and a black one."""
    folder = tmp_path_factory.mktemp("ceiling")
    (folder / "frames").mkdir()
    (folder / "camera.json").write_text(json.dumps(painter.camera.to_mapping()))
    rows = [f"{i},{x:.6f},{y:.6f}" for i, (x, y) in enumerate(painter.stars_m)]
    (folder / "ceiling.csv").write_text("\n".join(["id,x_m,y_m", *rows]) + "\n")
    rng = np.random.default_rng(61)
    for number, pose in enumerate(POSES):
        cv2.imwrite(str(folder / "frames" / f"{number:05d}.png"), painter.paint(rng, pose))
    cv2.imwrite(str(folder / "frames" / "00002.png"), np.zeros((480, 640), np.uint8))
    return folder


@pytest.fixture
def call(groundstation):
    return lambda *words: groundstation("star-tracker", *words)


def copy_of(folder, tmp_path):
    (tmp_path / "frames").mkdir()
    for path in [*folder.glob("*.*"), *folder.glob("frames/*")]:
        (tmp_path / path.relative_to(folder)).write_bytes(path.read_bytes())
    return tmp_path


@pytest.mark.parametrize("method", ["default", "published"])
def test_every_frame_gets_its_row_with_the_columns_of_the_format(call, ceiling_folder, tmp_path, method):
    out = tmp_path / "answers.csv"
    call("solve", ceiling_folder, "--out", out, "--method", method)
    with out.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [row["frame"] for row in rows] == ["00000", "00001", "00002"]
    assert [row["fix"] for row in rows] == ["1", "1", "0"]
    assert (rows[2]["x_m"], rows[2]["std_x_m"], rows[2]["stars"]) == ("", "", "0")
    assert rows[2]["reason"]
    assert all(float(row["ms"]) > 0.0 for row in rows)
    reach = 1e-4 if method == "default" else 0.02
    for row, pose in zip(rows[:2], POSES, strict=True):
        assert np.hypot(float(row["x_m"]) - pose[0], float(row["y_m"]) - pose[1]) < reach


def test_refused_frames_are_drawn_or_all_of_them(call, ceiling_folder, tmp_path):
    for options, names in (((), ["00002"]), (("--every-picture",), ["00000", "00001", "00002"])):
        folder = tmp_path / f"drawn{len(options)}"
        call("solve", ceiling_folder, "--out", tmp_path / "a.csv", "--pictures", folder, *options)
        assert sorted(path.name for path in folder.iterdir()) == [f"{name}.png" for name in names]
        assert cv2.imread(str(folder / "00002.png")).shape[1] == 2 * 640
    with pytest.raises(UsageError, match="--pictures"):
        call("solve", ceiling_folder, "--out", tmp_path / "a.csv", "--every-picture")
    with pytest.raises(FileError, match="no such folder can be made"):
        call("solve", ceiling_folder, "--out", tmp_path / "a.csv", "--pictures", tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: p.write_bytes(b""), "is an empty file"),
        (lambda p: p.write_bytes(p.read_bytes()[: p.stat().st_size // 2]), "cut short"),
        (lambda p: p.write_bytes(b"no picture at all IEND\xaeB`\x82"), "no picture"),
        (lambda p: cv2.imwrite(str(p), np.zeros((480, 640, 3), np.uint8)), "colour"),
        (lambda p: cv2.imwrite(str(p), np.zeros((240, 320), np.uint8)), "320 x 240"),
        (lambda p: cv2.imwrite(str(p), np.zeros((480, 640), np.uint16)), "16-bit"),
    ],
)
def test_a_bad_picture_is_named_and_nothing_is_written(call, ceiling_folder, tmp_path, make, words):
    folder = copy_of(ceiling_folder, tmp_path)
    make(folder / "frames" / "00001.png")
    with pytest.raises(FileError, match=words) as refusal:
        call("solve", folder, "--out", folder / "answers.csv", "--pictures", folder / "d", "--every-picture")
    assert "00001.png" in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert sorted(p.name for p in folder.iterdir()) == ["camera.json", "ceiling.csv", "frames"]


def test_a_jpeg_that_lost_bytes_gets_its_row_and_no_fix(call, ceiling_folder, tmp_path, painter):
    folder = copy_of(ceiling_folder, tmp_path)
    whole = cv2.imencode(".jpg", painter.paint(np.random.default_rng(62), POSES[0]))[1].tobytes()
    for name, file in (
        ("00000", whole[: len(whole) // 3] + whole[len(whole) // 3 + 300 :]),
        ("00003", whole + b"written by a camera"),
        ("00004", whole[:-2] + b"\x3a\x51\x07" + whole[-2:]),
    ):
        (folder / "frames" / f"{name}.png").unlink(missing_ok=True)
        (folder / "frames" / f"{name}.jpg").write_bytes(file)
    call("solve", folder, "--out", tmp_path / "answers.csv")
    with (tmp_path / "answers.csv").open(newline="") as file:
        rows = {row["frame"]: row for row in csv.DictReader(file)}
    assert [row["fix"] for row in rows.values()] == ["0", "1", "0", "1", "0"]
    assert rows["00000"]["reason"] == rows["00004"]["reason"] == "damaged picture"
    assert float(rows["00003"]["x_m"]) == pytest.approx(POSES[0][0], abs=1e-4)


def test_missing_folders_files_and_targets_are_named(call, ceiling_folder, tmp_path):
    with pytest.raises(FileError, match="no such folder"):
        call("solve", tmp_path / "nowhere", "--out", tmp_path / "a.csv")
    folder = copy_of(ceiling_folder, tmp_path)
    with pytest.raises(FileError, match="cannot be written"):
        call("solve", folder, "--out", folder / "no" / "a.csv")
    (folder / "ceiling.csv").unlink()
    with pytest.raises(FileError, match=r"ceiling\.csv"):
        call("solve", folder, "--out", folder / "a.csv")


def test_a_sweep_becomes_a_catalogue_that_solves_the_ceiling(call, ceiling_folder, tmp_path, painter):
    rng = np.random.default_rng(62)
    frames = tmp_path / "frames"
    frames.mkdir()
    camera = painter.camera.with_height(1.08 * painter.camera.ceiling_height_above_camera_m)
    (tmp_path / "camera.json").write_text(json.dumps(camera.to_mapping()))
    anchors = ["id,x_m,y_m,frame,u,v"]
    for number in range(8):
        pose = (1.6 + 0.25 * number, 1.9 + 0.1 * (number % 3), 0.3 * number)
        cv2.imwrite(str(frames / f"{number:05d}.png"), painter.paint(rng, pose))
        if number in (1, 6):
            star = painter.visible(pose, margin_px=60)[0 if number == 1 else -1]
            (x, y), (u, v) = painter.stars_m[star], painter.project(*pose)[star]
            anchors.append(f"{star},{x:.4f},{y:.4f},{number:05d},{u:.1f},{v:.1f}")
    (tmp_path / "anchors.csv").write_text("\n".join(anchors) + "\n")
    result = call(
        *("survey", tmp_path, "--out", tmp_path / "ceiling.csv", "--plot", tmp_path / "residuals.png"),
        *("--camera-out", tmp_path / "found.json", "--verify-every", 4),
    )
    assert "verification" in result.stdout
    assert (tmp_path / "residuals.png").read_bytes().startswith(b"\x89PNG")
    assert result.stderr == ""
    provenance = tomllib.loads((tmp_path / "ceiling.toml").read_text())
    assert provenance["pictures_held_out"] == provenance["pictures_verified"] == 2
    assert 0.0 < provenance["residual"]["verification_rms"]["value"] < 3e-4
    assert provenance["ceiling_height_above_camera_m"]["std"] > 0.0
    assert len(provenance["recording_sha256"]) == 64
    header = (tmp_path / "ceiling.csv").read_text().splitlines()[0]
    assert header == "id,x_m,y_m,std_x_m,std_y_m,times_seen"
    (tmp_path / "camera.json").write_text((tmp_path / "found.json").read_text())
    call("solve", tmp_path, "--out", tmp_path / "answers.csv")
    with (tmp_path / "answers.csv").open(newline="") as file:
        assert [row["fix"] for row in csv.DictReader(file)] == ["1"] * 8


def test_black_and_saturated_frames_are_answered_with_their_reasons(call, ceiling_folder, tmp_path):
    folder = copy_of(ceiling_folder, tmp_path)
    cv2.imwrite(str(folder / "frames" / "00001.png"), np.full((480, 640), 255, np.uint8))
    call("solve", folder, "--out", folder / "answers.csv")
    with (folder / "answers.csv").open(newline="") as file:
        reasons = [row["reason"] for row in csv.DictReader(file)]
    assert reasons == ["", "picture flooded with light", "no light spots"]


@pytest.mark.parametrize(
    ("file", "edit", "words"),
    [
        ("ceiling.csv", lambda text: text + "5,3.0,3.0\n", "'5' appears twice"),
        ("ceiling.csv", lambda text: text + "900,nan,3.0\n", "x_m is 'nan'"),
        ("ceiling.csv", lambda text: "\n".join(text.splitlines()[:4]) + "\n", "at least 4 stars"),
        ("camera.json", lambda text: text.replace('"fx"', '"focal"'), "'fx' is missing"),
        ("camera.json", lambda text: text[:40], "camera.json"),
    ],
    ids=["star twice", "NaN", "three stars", "missing key", "torn"],
)
@pytest.mark.parametrize("command", ["solve", "intrinsics", "mount"])
def test_a_wrong_sky_is_refused_in_one_sentence_by_every_command(
    call, ceiling_folder, tmp_path, command, file, edit, words
):
    folder = copy_of(ceiling_folder, tmp_path)
    path = folder / file
    path.write_text(edit(path.read_text()))
    with pytest.raises(FileError, match=words) as refusal:
        call(command, folder, "--out", folder / "out.toml")
    assert "\n" not in str(refusal.value)
    assert not (folder / "out.toml").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("id,x_m,y_m,frame,u,v\n0,1,1,00000,9,9\n", "at least two"),
        ("id,x_m,y_m,frame,u\n0,1,1,00000,9\n", "column 'v'"),
        ("id,x_m,y_m,frame,u,v\n0,1,1,77777,9,9\n", "77777"),
        ("id,x_m,y_m,frame,u,v\n0,1,east,00000,9,9\n", "y_m is 'east'"),
    ],
)
def test_wrong_anchors_are_refused_in_one_sentence(call, ceiling_folder, tmp_path, text, words):
    folder = copy_of(ceiling_folder, tmp_path)
    (folder / "anchors.csv").write_text(text)
    with pytest.raises(FileError, match=words):
        call("survey", folder, "--out", folder / "sky.csv")
    assert not (folder / "sky.csv").exists()


def test_the_lens_from_the_stars_is_written_with_its_provenance(call, ceiling_folder, tmp_path, painter):
    folder = copy_of(ceiling_folder, tmp_path)
    rng = np.random.default_rng(63)
    for number in range(3, 7):
        pose = (rng.uniform(1.5, 3.5), rng.uniform(1.3, 2.7), rng.uniform(-3, 3))
        cv2.imwrite(str(folder / "frames" / f"{number:05d}.png"), painter.paint(rng, pose))
    call("intrinsics", folder, "--out", folder / "lens.toml", "--camera-out", folder / "better.json")
    text = (folder / "lens.toml").read_text()
    for part in ("made_utc", "recording_sha256", "[fx]", "[k2]", "std = ", "[residual.reprojection_rms]"):
        assert part in text
    assert json.loads((folder / "better.json").read_text())["fx"] == pytest.approx(painter.camera.fx, abs=1.0)


def test_both_halves_of_a_method_are_chosen_apart_and_drawn(call, ceiling_folder, tmp_path):
    answers = {}
    for name, words in {
        "published": ("--method", "published"),
        "halves": ("--image", "published", "--identification", "published"),
        "ours": ("--method", "published", "--image", "default"),
        "level": ("--method", "published", "--level", "0.6"),
        "added": ("--method", "published", "--tree", "--drop-thin", "--only-similar", "--median"),
    }.items():
        out, plot = tmp_path / f"{name}.csv", tmp_path / f"{name}.png"
        call("solve", ceiling_folder, "--out", out, "--plot", plot, *words)
        assert plot.read_bytes().startswith(b"\x89PNG")
        with out.open(newline="") as file:
            answers[name] = [(row["fix"], row["x_m"]) for row in csv.DictReader(file)]
    assert answers["published"] == answers["halves"]
    assert len({str(answer) for answer in answers.values()}) == 4


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--method", "none"), "--method must be one of default, published"),
        (("--image", "none"), "--image must be one of"),
        (("--level", "0.5"), "goes with --image published"),
        (("--method", "published", "--level", "1"), "between 0 and 1"),
        (("--median",), "go with --identification published"),
        (("--method", "published", "--closeness-mm", "0"), "--closeness-mm must be above zero"),
    ],
)
def test_options_that_nothing_takes_are_refused(call, ceiling_folder, tmp_path, words, sentence):
    with pytest.raises(UsageError, match=sentence):
        call("solve", ceiling_folder, "--out", tmp_path / "a.csv", *words)
