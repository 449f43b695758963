"""Measure the star tracker on frames of the emulator, beside other methods on the same frames.

    python tools/bench_star_tracker.py
    python tools/bench_star_tracker.py --frames 100 --folder recordings/ceiling

Prints one row per quantity, ``| what | limit | measured | ok |``; exit code 1 if a limit is missed.
Times are CPU time of this process with one thread. astroalign joins if it is installed; ArUco and
AprilTag (OpenCV's) solve a ceiling of printed squares drawn for the same camera and poses.
"""

import argparse
import csv
import os
import sys
import time
from dataclasses import replace
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before NumPy loads
ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

import cv2  # noqa: E402
import numpy as np  # noqa: E402
from bench_star_laboratory import (  # noqa: E402
    CAMERA_FILE,
    CEILING_FILE,
    TAGS,
    Frame,
    Laboratory,
    Score,
    run,
    spots_at,
)
from bench_star_peers import PEERS, SquareCeiling  # noqa: E402

from calibration.camera import CameraCalibration, StarCatalogue  # noqa: E402
from groundstation.star_tracking.detection import detect  # noqa: E402
from groundstation.star_tracking.fixes import BodyMotion, StarFix  # noqa: E402
from groundstation.star_tracking.published import PublishedTracker  # noqa: E402
from groundstation.star_tracking.rays import CeilingRays  # noqa: E402
from groundstation.star_tracking.self_calibration import calibrate_intrinsics  # noqa: E402
from groundstation.star_tracking.sky_adjustment import project  # noqa: E402
from groundstation.star_tracking.survey import Anchor, survey  # noqa: E402
from groundstation.star_tracking.tracker import StarTracker, TrackerSettings  # noqa: E402

POSITION_LIMIT_MM = {"easy": 0.030, "edge": 0.060, "blur": 0.22, "sparse": 0.30}
HEADING_LIMIT_DEG = {"easy": 0.0016, "blur": 0.014, "sparse": 0.014}


class Table:
    """Rows as they come; remembers whether one missed its limit."""

    def __init__(self) -> None:
        self.is_missed = False

    def row(self, what: str, limit: str, measured: str, *, ok: bool | None = None) -> None:
        """Print a row; ok is None where there is no limit."""
        self.is_missed |= ok is False
        verdict = {True: "yes", False: "no", None: ""}[ok]
        print(f"| {what} | {limit} | {measured} | {verdict} |", flush=True)


def unit_ms(image: np.ndarray) -> float:
    """CPU time of cv2.GaussianBlur 5x5 on one frame: the unit of ratios."""
    times = []
    for _ in range(200):
        begin = time.process_time()
        cv2.GaussianBlur(image, (5, 5), 0)
        times.append(time.process_time() - begin)
    return 1e3 * float(np.median(times))


def bench_frames(table: Table, lab: Laboratory, tracker: StarTracker, count: int) -> list[Frame]:
    """Every kind of frame: time, rate, accuracy."""
    frames = [frame for tag in TAGS for frame in lab.frames(tag, count)]
    for frame in frames[:20]:
        tracker.solve(detect(frame.image))  # warm
    score = run(frames, tracker.solve)
    report(table, score, unit_ms(frames[0].image))
    return frames


def report(table: Table, score: Score, unit: float) -> None:
    """The rows of a score."""
    total = np.add(score.detect_ms, score.solve_ms)
    median, p99 = np.percentile(total, [50, 99])
    table.row(
        "star tracker: total CPU ms per frame, median / p99",
        "3.0 / 7",
        f"{median:.2f} / {p99:.2f} ({median / unit:.0f} / {p99 / unit:.0f} units of {unit:.2f} ms)",
        ok=bool(median <= 3.0 and p99 <= 7.0),
    )
    median, p99 = np.percentile(score.solve_ms, [50, 99])
    table.row(
        "star tracker: identification and refinement ms, median / p99",
        "1.5 / 4",
        f"{median:.2f} / {p99:.2f}",
        ok=bool(median <= 1.5 and p99 <= 4.0),
    )
    worst = max(score.dark_ms)
    table.row("star tracker: frame that matches nothing, worst ms", "12", f"{worst:.2f}", ok=worst <= 12.0)
    for tag in TAGS[:-1]:
        need = 0.98 if tag == "sparse" else 0.995
        rate = score.rate(tag)
        table.row(
            f"star tracker: identified, {tag}", f"{100 * need:g} %", f"{100 * rate:.1f} %", ok=rate >= need
        )
    table.row("star tracker: false fixes on these frames", "0", str(score.false), ok=score.false == 0)
    for tag in TAGS[:-1]:
        position, heading = score.rms(tag)
        limit, turn = POSITION_LIMIT_MM.get(tag), HEADING_LIMIT_DEG.get(tag)
        is_good = None if limit is None else position <= limit and (turn is None or heading <= turn)
        wanted = "" if limit is None else f"{limit:g} mm" + ("" if turn is None else f", {turn:g} deg")
        table.row(
            f"star tracker: position and heading RMS, {tag}",
            wanted,
            f"{position:.4f} mm, {heading:.5f} deg",
            ok=is_good,
        )
    ratio = float(np.mean(score.chi2))
    table.row("star tracker: chi-square of errors / 3", "0.5 to 2", f"{ratio:.2f}", ok=0.5 <= ratio <= 2.0)


def bench_jpeg(table: Table, frames: list[Frame], tracker: StarTracker) -> None:
    """Easy frames once through JPEG."""
    easy = [frame for frame in frames if frame.tag == "easy"]
    squeezed = []
    for frame in easy:
        _, data = cv2.imencode(".jpg", frame.image, [cv2.IMWRITE_JPEG_QUALITY, 90])
        squeezed.append(replace(frame, image=cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)))
    position, heading = run(squeezed, tracker.solve).rms("easy")
    measured = f"{position:.4f} mm, {heading:.5f} deg"
    table.row("star tracker: easy frames as MJPEG quality 90, RMS", "", measured)


def bench_random_lights(table: Table, tracker: StarTracker, trials: int) -> None:
    """Lights that are no ceiling."""
    rng = np.random.default_rng(5)
    false = tried = 0
    for lights in (3, 4, 5, 6, 8, 12, 20, 40):
        for _ in range(trials):
            spots = spots_at(rng.uniform((3, 3), (636, 476), (lights, 2)))
            false += isinstance(tracker.solve(spots), StarFix)
            tried += 1
    table.row(f"star tracker: false fixes on {tried} frames of random lights", "0", str(false), ok=false == 0)


def bench_many_leds(table: Table, camera: CameraCalibration) -> None:
    """A hall with ten thousand LEDs."""
    rng = np.random.default_rng(6)
    side = np.sqrt(10_000 / 9.0)
    leds = rng.uniform(0.0, side, (10_000, 2))
    tracker = StarTracker(StarCatalogue.from_positions(leds), camera)
    times, found = [], 0
    for _ in range(100):
        pose = np.array([*rng.uniform(2.0, side - 2.0, 2), rng.uniform(-np.pi, np.pi)])
        near = leds[np.hypot(*(leds - pose[:2]).T) < 1.6]
        uv, _ = project(camera, np.tile(pose, (len(near), 1)), near)
        inside = (uv > 4).all(axis=1) & (uv < (camera.width - 5, camera.height - 5)).all(axis=1)
        uv = uv[inside & (rng.random(len(uv)) > 0.05)]
        spots = spots_at(uv + rng.normal(0.0, 0.03, uv.shape))
        begin = time.process_time()
        answer = tracker.solve(spots)
        times.append(1e3 * (time.process_time() - begin))
        found += isinstance(answer, StarFix) and np.hypot(answer.x_m - pose[0], answer.y_m - pose[1]) < 0.02
    median = float(np.median(times))
    table.row(
        "star tracker: 10,000 LEDs, identification ms median",
        "6",
        f"{median:.2f} ({found} of 100 found)",
        ok=median <= 6.0 and found == 100,
    )


def bench_survey(table: Table, lab: Laboratory, camera: CameraCalibration) -> None:
    """A catalogue from a sweep."""
    rng, heading, pictures, poses = np.random.default_rng(8), 0.0, [], []
    lines = np.linspace(lab.leds[:, 1].min() + 0.6, lab.leds[:, 1].max() - 0.6, 6)
    for number, y in enumerate(lines):
        xs = np.linspace(lab.leds[:, 0].min() + 0.6, lab.leds[:, 0].max() - 0.6, 12)
        for x in xs if number % 2 == 0 else xs[::-1]:
            heading += 0.11
            pose = np.array([x + rng.normal(0, 0.02), y + rng.normal(0, 0.02), heading])
            pictures.append(detect(lab.picture(pose, rng.uniform(-0.05, 0.05, 3))))
            poses.append(pose)
    tracker = StarTracker(StarCatalogue.from_positions(lab.leds), camera)
    anchors = []
    for frame in (20, 40, 60):
        fix = tracker.solve(pictures[frame])
        spot, star = fix.spot_index[0], int(fix.star_index[0])
        tape = lab.leds[star] + rng.normal(0.0, 1e-3, 2)
        click = (pictures[frame].u_px[spot] + 2.0, pictures[frame].v_px[spot] - 2.0)
        anchors.append(Anchor(str(star), *tape, frame, *click))
    height = camera.ceiling_height_above_camera_m
    sky = survey(pictures, anchors, camera.with_height(1.1 * height))
    found, true = sky.star_m @ [1, 1j], lab.leds @ [1, 1j]
    distance = np.abs(found[:, None] - true)
    goal = true[distance.argmin(axis=1)]
    real = distance.min(axis=1) < 0.03
    centred = found[real] - found[real].mean()
    factor = ((goal[real] - goal[real].mean()) * np.conj(centred)).sum() / (np.abs(centred) ** 2).sum()
    error = factor * centred - (goal[real] - goal[real].mean())
    rms = 1e3 * float(np.sqrt((np.abs(error) ** 2).mean()))
    ratio = float(np.sqrt(np.mean((np.column_stack((error.real, error.imag)) / sky.std_m[real]) ** 2)))
    table.row(
        "star tracker: survey of the LEDs from 72 frames, RMS of the shape; error over reported std",
        "0.3 mm; 1.5",
        f"{rms:.3f} mm; {ratio:.2f} ({int(real.sum())} of {len(true)} LEDs, {int((~real).sum())} others)",
        ok=rms <= 0.3 and 1 / 1.5 <= ratio <= 1.5,
    )


def bench_lens(table: Table, lab: Laboratory, camera: CameraCalibration, catalogue: StarCatalogue) -> None:
    """The lens from the stars."""
    middle = lab.leds.mean(axis=0)
    poses = [(*middle, heading) for heading in np.linspace(0.0, 2 * np.pi, 36)]
    pictures = [detect(lab.picture(pose)) for pose in poses]
    size = (camera.width, camera.height)
    wrong = replace(
        camera,
        fx=0.97 * camera.fx,
        fy=0.97 * camera.fy,
        cx=0.5 * (size[0] - 1),
        cy=0.5 * (size[1] - 1),
        distortion=(0.0, 0.0, 0.0, 0.0, 0.0),
    )
    found = calibrate_intrinsics(pictures, catalogue, wrong, wobble_std_m=2e-5)
    frames = list(lab.frames("easy", 40))
    known = run(frames, StarTracker(catalogue, camera).solve).rms("easy")[0]
    ours = run(frames, StarTracker(catalogue, found.camera).solve).rms("easy")[0]
    rms = found.adjusted.rms_px
    table.row(
        "star tracker: self-calibrated lens, reprojection RMS; pose error over that of the true lens",
        "0.1 px; 2",
        f"{rms:.3f} px; {ours / known:.2f}",
        ok=rms <= 0.1 and ours / known <= 2.0,
    )


def bench_rolling_shutter(
    table: Table, lab: Laboratory, camera: CameraCalibration, catalogue: StarCatalogue
) -> None:
    """Rows read one after another, the velocity known."""
    tracker = StarTracker(catalogue, camera, TrackerSettings(exposure_s=0.01, readout_s=0.025))
    square = 0.0
    poses = lab.poses(40)
    for pose in poses:
        way = lab.rng.uniform(-np.pi, np.pi)
        velocity = np.array([0.5 * np.cos(way), 0.5 * np.sin(way), lab.rng.uniform(-0.5, 0.5)])
        spots = detect(lab.picture(pose, velocity, 0.01, 0.025))
        fix = tracker.solve(spots, motion=BodyMotion(*velocity))
        if not isinstance(fix, StarFix):
            square = float("inf")
            break
        square += (fix.x_m - pose[0]) ** 2 + (fix.y_m - pose[1]) ** 2
    rms = 1e3 * float(np.sqrt(square / len(poses)))
    measured = f"{rms:.3f} mm"
    table.row(
        "star tracker: rolling shutter 25 ms at 0.5 m/s, position RMS", "0.5 mm", measured, ok=rms <= 0.5
    )


def bench_peers(
    table: Table, frames: list[Frame], catalogue: StarCatalogue, camera: CameraCalibration
) -> None:
    """Other methods on the same frames."""
    ours = run(frames, StarTracker(catalogue, camera).solve)
    ours_ms = float(np.median(np.add(ours.detect_ms, ours.solve_ms)))
    ours_mm = ours.rms("easy")[0]
    published = run(frames, PublishedTracker(catalogue, camera).solve)
    median = float(np.median(np.add(published.detect_ms, published.solve_ms)))
    position = published.rms("easy")[0]
    table.row(
        "beside: published method, time and easy position error over ours",
        "",
        f"{median / ours_ms:.1f}, {position / ours_mm:.0f}; sparse {100 * published.rate('sparse'):.0f} %",
    )
    few = [f for f in frames if f.tag == "easy"][:12]
    for name, peer in PEERS.items():
        measured = peer(few, catalogue, CeilingRays(camera))
        if measured is None:
            table.row(f"beside: {name}", "", "not installed")
            continue
        ms, mm, found = measured
        table.row(
            f"beside: {name}, time and easy position error over ours",
            "",
            f"{ms / ours_ms:.1f}, {mm / ours_mm:.0f}; found {found} of {len(few)}",
        )
    for name in ("ArUco 4x4", "AprilTag 36h11"):
        ms, mm, found = SquareCeiling(name, camera, catalogue).measure([f.pose for f in few])
        table.row(
            f"beside: {name} squares instead of LEDs, time and easy position error over ours",
            "",
            f"{ms / ours_ms:.1f}, {mm / ours_mm:.0f}; found {found} of {len(few)}",
        )


def bench_folder(table: Table, folder: Path) -> None:
    """Frames of a recorded data set with truth.csv, by tag."""
    camera = CameraCalibration.load(folder / "camera.json")
    tracker = StarTracker(StarCatalogue.load(folder / "ceiling.csv"), camera)
    frames = []
    with (folder / "truth.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            image = cv2.imread(str(folder / "frames" / f"{row['frame']}.png"), cv2.IMREAD_UNCHANGED)
            pose = (float(row["x_m"]), float(row["y_m"]), float(row["heading_rad"]))
            frames.append(Frame(row["tags"].split(";")[0], image, pose if row["has_fix"] == "1" else None))
    score = run(frames, tracker.solve)
    for tag in dict.fromkeys(frame.tag for frame in frames):
        position, heading = score.rms(tag)
        table.row(
            f"{folder.name}: {tag}",
            "",
            f"{100 * score.rate(tag):.1f} %, {position:.4f} mm, {heading:.5f} deg",
        )
    table.row(f"{folder.name}: false fixes", "0", str(score.false), ok=score.false == 0)


def main() -> int:
    """Run all of it."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--frames", type=int, default=60, help="per kind of frame")
    parser.add_argument("--trials", type=int, default=400, help="per number of random lights")
    parser.add_argument("--folder", type=Path, help="a data set with truth.csv to measure as well")
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    camera, catalogue = CameraCalibration.load(CAMERA_FILE), StarCatalogue.load(CEILING_FILE)
    table, lab, tracker = Table(), Laboratory(1), StarTracker(catalogue, camera)
    frames = bench_frames(table, lab, tracker, arguments.frames)
    bench_jpeg(table, frames, tracker)
    bench_random_lights(table, tracker, arguments.trials)
    bench_many_leds(table, camera)
    bench_survey(table, lab, camera)
    bench_lens(table, lab, camera, catalogue)
    bench_rolling_shutter(table, lab, camera, catalogue)
    bench_peers(table, frames, catalogue, camera)
    if arguments.folder is not None:
        bench_folder(table, arguments.folder)
    return int(table.is_missed)


if __name__ == "__main__":
    raise SystemExit(main())
