"""Films of a target: tracked, drawn, reviewed; broken and changing ones; target files from clicks."""

import csv
import json
import resource
import shlex
import tomllib

import cv2
import numpy as np
import pytest
from oracles import relative_pictures as pictures
from oracles import relative_scenes as scenes

from groundstation.declarations.errors import UsageError
from groundstation.files.errors import FileError

FRAMES = 8
POINTS = scenes.CUBE + np.array([[0, 0.1, 0], [0, 0, 0], [0.12, 0, 0], [0, 0, 0.1], [0, 0, 0], [0, 0.05, 0]])
"""Without symmetry: found from nothing."""


@pytest.fixture
def call(groundstation):
    return lambda *words: groundstation("relative", *words)


def read(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """A folder with frames of a target that leaves: truth, pictures, archive, video, case."""
    folder = tmp_path_factory.mktemp("film")
    rng = np.random.default_rng(8)
    motion = scenes.leaving(6, np.arange(FRAMES) * 0.5, nearest=4.0)
    scene = scenes.Scene(points_m=POINTS)
    shots = []
    for rotation, position in zip(motion.rotations, motion.positions_m, strict=True):
        pixels, radii = pictures.tips(scene, rotation, position, 0.03)
        shots.append(pictures.paint(pixels, radii, rng))
    np.savez(folder / "frames.npz", frames=np.stack(shots))
    (folder / "frames").mkdir()
    writer = cv2.VideoWriter(str(folder / "film.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 2.0, (640, 480))
    for number, shot in enumerate(shots):
        cv2.imwrite(str(folder / "frames" / f"{number:03d}.png"), shot)
        writer.write(cv2.cvtColor(shot, cv2.COLOR_GRAY2BGR))
    writer.release()
    (folder / "case.json").write_text(json.dumps(scene.case(labelled=False)))
    return folder, motion


def misses(rows, motion):
    return [
        float(np.linalg.norm([float(row[k]) for k in "xyz"] - position))
        for row, position in zip(rows, motion.positions_m, strict=True)
    ]


@pytest.mark.parametrize("source", ["frames.npz", "frames", "film.avi"])
def test_a_film_is_tracked_from_nothing(call, film, tmp_path, source):
    folder, motion = film
    out = tmp_path / "poses.csv"
    call("track", folder / "case.json", "--video", folder / source, "--out", out, "--rate-hz", "2")
    rows = read(out)
    assert len(rows) == FRAMES
    assert {row["status"] for row in rows} == {"solved"}
    assert max(misses(rows, motion)) < (0.02 if source == "film.avi" else 0.01)
    assert [float(row["t"]) for row in rows] == pytest.approx(motion.times_s)


def test_the_annotated_film_and_the_page_show_every_frame(call, film, tmp_path):
    folder, _ = film
    names = {name: tmp_path / name for name in ("seen.avi", "review.html", "rates.csv")}
    words = (
        "--annotated",
        names["seen.avi"],
        "--review",
        names["review.html"],
        "--rates",
        names["rates.csv"],
    )
    call("track", folder / "case.json", "--video", folder / "film.avi", "--out", tmp_path / "p.csv", *words)
    video = cv2.VideoCapture(str(names["seen.avi"]))
    shown = 0
    while True:
        there, picture = video.read()
        if not there:
            break
        shown += 1
        assert picture.shape == (480, 640, 3)
    assert shown == FRAMES
    page = names["review.html"].read_text()
    assert page.count("<figure>") == FRAMES
    assert "residual" in page
    assert len(read(names["rates.csv"])) == FRAMES
    assert sorted(p.name for p in tmp_path.iterdir()) == ["p.csv", "rates.csv", "review.html", "seen.avi"]


def test_a_film_that_ends_in_a_broken_frame_is_tracked_to_there(call, film, tmp_path):
    folder, motion = film
    data = (folder / "film.avi").read_bytes()
    (tmp_path / "torn.avi").write_bytes(data[: int(0.7 * len(data))])
    said = call(
        "track",
        folder / "case.json",
        "--video",
        tmp_path / "torn.avi",
        "--out",
        tmp_path / "p.csv",
        "--rate-hz",
        "2",
    )
    rows = read(tmp_path / "p.csv")
    assert rows[0]["status"] == "solved"
    solved = [row for row in rows if row["status"] == "solved"]
    assert max(misses(solved, type(motion)(None, None, motion.positions_m[: len(solved)], None))) < 0.02
    assert len(rows) < FRAMES or "broken" in said.output
    assert all(row["status"] in ("solved", "propagated") for row in rows)


def test_frames_of_other_sizes_and_without_a_target_are_propagated(call, film, tmp_path, rng):
    folder, _ = film
    (tmp_path / "frames").mkdir()
    shots = [cv2.imread(str(folder / "frames" / f"{i:03d}.png"), cv2.IMREAD_GRAYSCALE) for i in range(FRAMES)]
    shots[3] = shots[3][:240]
    shots[4] = np.clip(rng.normal(3, 1, (480, 640)), 0, 255).astype(np.uint8)
    shots[5] = pictures.paint([(320, 240)], [200.0], rng, level=500.0)
    for number, shot in enumerate(shots):
        cv2.imwrite(str(tmp_path / "frames" / f"{number:03d}.png"), shot)
    (tmp_path / "frames" / "007.png").write_bytes(b"no picture")
    said = call("track", folder / "case.json", "--video", tmp_path / "frames", "--out", tmp_path / "p.csv")
    rows = read(tmp_path / "p.csv")
    assert [row["status"] for row in rows] == ["solved"] * 3 + ["propagated"] * 3 + ["solved", "propagated"]
    assert float(rows[5]["std_pos_m"]) > float(rows[2]["std_pos_m"])
    for words in ("another size", "all dark", "Sun", "broken"):
        assert words in said.output


def test_an_annotated_film_that_cannot_be_written_whole_leaves_the_one_that_was_there(call, film, tmp_path):
    folder, _ = film
    seen, out = tmp_path / "seen.avi", tmp_path / "p.csv"
    seen.write_bytes(b"the film of yesterday")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, limits[1]))  # as a disk that is nearly full
    try:
        with pytest.raises(FileError, match=r"seen\.avi: cannot be written"):
            call(
                "track",
                folder / "case.json",
                "--video",
                folder / "film.avi",
                "--out",
                out,
                "--annotated",
                seen,
            )
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert seen.read_bytes() == b"the film of yesterday"
    assert [path.name for path in tmp_path.iterdir()] == ["seen.avi"]


def test_decoders_print_nothing_of_their_own_and_bad_frames_are_counted(call, film, tmp_path, capfd):
    folder, _ = film
    data, rng = bytearray((folder / "film.avi").read_bytes()), np.random.default_rng(3)
    for place in rng.integers(6000, len(data) // 2, 200).tolist():
        data[place] ^= 0x5A
    (tmp_path / "bad.avi").write_bytes(data[: int(0.7 * len(data))])
    said = call("track", folder / "case.json", "--video", tmp_path / "bad.avi", "--out", tmp_path / "p.csv")
    assert capfd.readouterr().err == ""
    assert f"of {FRAMES} frames cannot be read" in said.output
    assert "the decoder of the film complained at" in said.output


def test_a_picture_that_comes_twice_is_not_solved_twice(call, film, tmp_path):
    folder, _ = film
    frames = np.load(folder / "frames.npz")["frames"]
    np.savez(tmp_path / "frozen.npz", frames=frames[[0, 1, 2, 2, 2, 5]])
    said = call(
        "track",
        folder / "case.json",
        "--video",
        tmp_path / "frozen.npz",
        "--out",
        tmp_path / "p.csv",
        "--rate-hz",
        "2",
    )
    assert [row["status"] for row in read(tmp_path / "p.csv")] == [
        *["solved"] * 3,
        "propagated",
        "propagated",
        "solved",
    ]
    assert "repeats the one before byte for byte: 2" in said.output


def test_a_film_without_any_target_gives_no_pose(call, film, tmp_path, rng):
    folder, _ = film
    frames = np.stack([pictures.paint(rng.uniform(50, 400, (9, 2)), np.full(9, 2.0), rng) for _ in range(3)])
    np.savez(tmp_path / "strays.npz", frames=frames)
    call("track", folder / "case.json", "--video", tmp_path / "strays.npz", "--out", tmp_path / "p.csv")
    rows = read(tmp_path / "p.csv")
    assert {row["status"] for row in rows} == {"lost"}
    assert {row["x"] for row in rows} == {"nan"}


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda p: (p / "film.avi").write_bytes(b""), "empty"),
        (lambda p: (p / "film.avi").write_bytes(b"no film at all"), "no video"),
        (lambda p: None, "no such file"),
        (lambda p: (p / "film.avi").mkdir(), "no picture"),
    ],
)
def test_what_is_no_film_is_refused(call, film, tmp_path, make, words):
    make(tmp_path)
    with pytest.raises(FileError, match=words):
        call("track", film[0] / "case.json", "--video", tmp_path / "film.avi", "--out", tmp_path / "p.csv")
    assert not (tmp_path / "p.csv").exists()


def test_options_that_do_not_go_together_are_refused(call, film, tmp_path):
    folder, _ = film
    case, out = folder / "case.json", tmp_path / "p.csv"
    for words, sentence in (
        ((case, "--video", "a", "--pixels", "b", "--out", out), "either"),
        ((case, "--pixels", "b", "--out", out, "--review", tmp_path / "r.html"), "go with --video"),
        (
            (case, "--video", folder / "film.avi", "--out", out, "--annotated", tmp_path / "a.gif"),
            "of --annotated ends in",
        ),
        (("--video", folder / "film.avi", "--out", out), "one case"),
        ((case, "--video", folder / "film.avi", "--out", out, "--rate-hz", "1e-6"), "0.001 to 10000"),
        ((case, "--video", folder / "film.avi"), "--out"),
    ):
        with pytest.raises((UsageError, FileError), match=sentence):
            call("track", *words)
    small = json.loads(case.read_text())
    small["camera"] |= {"width": 320}
    (tmp_path / "small.json").write_text(json.dumps(small))
    with pytest.raises(FileError, match="640 x 480"):
        call("track", tmp_path / "small.json", "--video", folder / "film.avi", "--out", out)


def test_the_call_on_the_page_is_one_for_a_shell_whatever_the_name(call, film, tmp_path):
    odd = tmp_path / "a folder"
    odd.mkdir()
    picture = odd / 'my "tips" </script> $HOME.png'.replace("/", "")
    picture.write_bytes((film[0] / "frames" / "000.png").read_bytes())
    call("target", picture, "--out", tmp_path / "click.html")
    page = (tmp_path / "click.html").read_text()
    (line,) = [row for row in page.splitlines() if '.textContent="groundstation' in row]
    said = json.loads(line[line.index('="') + 1 : line.rindex('+" "+')])
    words = ["groundstation", "relative", "target", str(picture), "--out", "target.toml", "--f-px", "750"]
    assert shlex.split(said) == words
    assert "<" not in line


def test_points_that_look_alike_in_many_turns_are_refused(call, film, tmp_path):
    folder, _ = film
    angles = np.arange(12) * (2.0 * np.pi / 12)
    ring = np.column_stack((np.cos(angles), np.sin(angles), 0.0 * angles)).tolist()
    case = json.loads((folder / "case.json").read_text()) | {"points_m": ring}
    (tmp_path / "ring.json").write_text(json.dumps(case))
    words = ("--video", folder / "film.avi", "--out", tmp_path / "p.csv")
    with pytest.raises(FileError, match="points_m look the same after 23 turns, and at most 4 poses"):
        call("track", tmp_path / "ring.json", *words)


def test_a_target_file_is_made_from_clicks_and_lengths(call, film, tmp_path):
    folder, motion = film
    pixels = scenes.Scene(points_m=POINTS).pixels(motion.rotations[0], motion.positions_m[0])
    words = []
    for (u, v), (x, y, z) in zip(np.round(pixels), POINTS, strict=True):
        words += ["--point", f"{u},{v},{x},{y},{z}"]
    picture = folder / "frames" / "000.png"
    said = call("target", picture, "--out", tmp_path / "target.toml", "--f-px", "750", *words)
    assert "6 points written" in said.output
    made = tomllib.loads((tmp_path / "target.toml").read_text())
    assert np.linalg.norm(np.array(made["guess_frame0"]["t"]) - motion.positions_m[0]) < 0.1
    out = tmp_path / "p.csv"
    call("track", "--target", tmp_path / "target.toml", "--video", folder / "frames.npz", "--out", out)
    assert {row["status"] for row in read(out)} == {"solved"}
    wrong = [*words]
    wrong[1] = "600.0,20.0,0.55,0.1,0.25"
    said = call("target", picture, "--out", tmp_path / "wrong.toml", "--f-px", "750", *wrong)
    assert "is wrong" in said.output
    call("target", picture, "--out", tmp_path / "click.html")
    assert "canvas" in (tmp_path / "click.html").read_text()
    for bad, sentence in (
        (("--point", "1,2,3"), "u,v,x,y,z"),
        (("--point", "900,2,0,0,0"), "not in the picture"),
    ):
        with pytest.raises(UsageError, match=sentence):
            call("target", picture, "--out", tmp_path / "t.toml", "--f-px", "750", *bad)
    for diameter in ("0", "-1", "1e308", "nan"):
        with pytest.raises(UsageError, match=r"^--tip-diameter-m (is|must be)"):
            call("target", picture, "--out", tmp_path / "t.toml", "--f-px", "750", *words,
                 "--tip-diameter-m", diameter)  # fmt: skip
    one_pixel = [
        f"320,240,{x},{y},{z}" if k % 2 else "--point" for k, (x, y, z) in enumerate(np.repeat(POINTS, 2, 0))
    ]
    said = call("target", picture, "--out", tmp_path / "t.toml", "--f-px", "750", *one_pixel)
    assert "two clicks are in one place, so no pose checks them" in said.output
    with pytest.raises(FileError, match="same place"):
        call("target", picture, "--out", tmp_path / "t.toml", "--f-px", "750", *words, *words[:2])
