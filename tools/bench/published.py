"""The published methods to the letter, and the published experiments run again.

The methods are measured on data sets with truth: those of ``--folder`` where it holds any (``camera.json``
somewhere below for the identification, folders ``station`` and ``perimeter`` for the motion), else on
generated ones.
"""

import csv
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from bench.fusion.data import SCENARIOS, folders_of
from bench.fusion.score import flown
from bench.rows import Bench, Row
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, TAGS, Frame, Laboratory
from bench.star.score import GATE_M, GATE_RAD
from groundstation.data_sets.fusion_folder import read_folder
from groundstation.fusion.flight_data import estimate
from groundstation.fusion.published_motion import imu_alone, joint
from groundstation.fusion.published_settings import AS_PUBLISHED
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.fixes import PictureFix
from groundstation.star_tracking.identifications import IDENTIFICATIONS, IMAGES, SkySettings
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.studies.running import reproduce
from groundstation.studies.table import studies

SEED = 3
PICTURES = 30
LEVELS = (0.2, 0.3, 0.5)
FLIGHTS = ("station", "perimeter")
AFTER_S = 10.0
MOST_S = 360.0
STUDY = "air-table"


@dataclass(frozen=True, slots=True)
class Reported:
    """What an independent rewrite of the published methods gave on the sample data sets."""

    found: int
    false: int
    rms_mm: float
    joint_mm: Mapping[str, float]
    imu_mm: Mapping[str, float]


REWRITE = Reported(59, 2, 4.6, {"station": 4.4, "perimeter": 6.4}, {"station": 43.0, "perimeter": 12.0})


def measure(bench: Bench) -> list[Row]:
    """Rows of the identification, of the motion, and of the study's run."""
    return [*_identification(bench), *_motion(bench), *_study(bench)]


def _identification(bench: Bench) -> list[Row]:
    sky = _sky_below(bench.data)
    if sky is None:
        camera, catalogue = CameraCalibration.load(CAMERA_FILE), StarCatalogue.load(CEILING_FILE)
        laboratory = Laboratory(SEED)
        frames = [each for tag in TAGS for each in laboratory.frames(tag, min(PICTURES, bench.frames))]
    else:
        camera, catalogue = (
            CameraCalibration.load(sky / "camera.json"),
            StarCatalogue.load(sky / "ceiling.csv"),
        )
        frames = _frames_of(sky)
    rows = [_found(frames, camera, catalogue, "default", SkySettings(), is_sample=sky is not None)]
    for level in LEVELS:
        bench.say(f"published: picture steps, level {level:g}")
        settings = SkySettings(level_ratio=level)
        rows.append(_found(frames, camera, catalogue, "published", settings, is_sample=False))
    return rows


def _sky_below(folder: Path | None) -> Path | None:
    found = sorted(folder.rglob("camera.json")) if folder is not None else []
    return next((path.parent for path in found if (path.parent / "truth.csv").exists()), None)


def _frames_of(folder: Path) -> list[Frame]:
    frames = []
    with (folder / "truth.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            image = cv2.imread(str(folder / "frames" / f"{row['frame']}.png"), cv2.IMREAD_GRAYSCALE)
            pose = (float(row["x_m"]), float(row["y_m"]), float(row["heading_rad"]))
            is_there = row["has_fix"] == "1"
            frames.append(Frame("all", np.asarray(image, np.uint8), pose if is_there else None))
    return frames


def _found(
    frames: Sequence[Frame],
    camera: CameraCalibration,
    catalogue: StarCatalogue,
    image: str,
    settings: SkySettings,
    *,
    is_sample: bool,
) -> Row:
    find, solver = IMAGES[image](settings), IDENTIFICATIONS["published"](catalogue, camera, settings)
    errors_m, false = [], 0
    for frame in frames:
        answer = solver.solve(find(frame.image))
        if not isinstance(answer, PictureFix):
            continue
        if frame.pose is not None:
            off_m = float(np.hypot(answer.x_m - frame.pose[0], answer.y_m - frame.pose[1]))
            turned = abs(np.remainder(answer.heading_rad - frame.pose[2] + np.pi, 2 * np.pi) - np.pi)
            if off_m <= GATE_M and turned <= GATE_RAD:
                errors_m.append(off_m)
                continue
        false += 1
    there = sum(frame.pose is not None for frame in frames)
    rms_mm = 1e3 * float(np.sqrt(np.mean(np.square(errors_m)))) if errors_m else float("nan")
    spots = "our spots" if image == "default" else f"published picture steps, level {settings.level_ratio:g}"
    what = f"published identification, {spots}: identified / false / RMS"
    measured = f"{len(errors_m)} of {there} / {false} / {rms_mm:.1f} mm"
    if not is_sample:
        return Row(what, "", measured, None)
    ok = abs(len(errors_m) - REWRITE.found) <= 3 and abs(rms_mm - REWRITE.rms_mm) <= 1.0
    limit = f"{REWRITE.found} within 3 / {REWRITE.false} / {REWRITE.rms_mm:g} mm within 1"
    return Row(what, limit, measured, ok)


def _motion(bench: Bench) -> list[Row]:
    rows = []
    for name in FLIGHTS:
        folder = _flight_below(bench.data, name)
        is_sample = folder is not None
        if folder is None:
            (scenario,) = [each for each in SCENARIOS if each.name == name]
            folder = next(iter(folders_of(bench, scenario)))
        bench.say(f"published: {name}")
        figures = flown(folder, joint, is_cleaned=True)
        rows.append(_row(f"published joint method, {name}, wrong fixes taken out: RMS", figures.position_mm,
                         REWRITE.joint_mm[name] if is_sample else None, 0.10))  # fmt: skip
        off_mm = _imu_off_mm(folder)
        rows.append(
            Row(f"published IMU alone, {name}: off after {AFTER_S:g} s", "", f"{off_mm:.1f} mm", None)
        )
        # one wild sample in the rest rules its mean; the rewrite took the median
        reported = REWRITE.imu_mm[name] if is_sample else None
        what = f"the same with zeros by the rest's median, {name}"
        rows.append(_row(what, _imu_off_mm(folder, median_zeros=True), reported, 0.20))
    return rows


def _flight_below(folder: Path | None, name: str) -> Path | None:
    found = sorted(folder.rglob(name)) if folder is not None else []
    return next((path for path in found if (path / "truth.csv").exists()), None)


def _imu_off_mm(folder: Path, *, median_zeros: bool = False) -> float:
    """Distance from the truth 10 s after the start of the motion."""
    data = read_folder(folder)
    settings = AS_PUBLISHED.model_copy(update={"median_zeros": median_zeros})
    states, _ = estimate(data, imu_alone(data.noise, settings))
    row = int(np.searchsorted(data.imu[:, 0], data.run_start_s + AFTER_S))
    state = next(each for each in states[row:] if each is not None)
    truth = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    x_m, y_m = (np.interp(state.t_ns * 1e-9, truth["t_s"], truth[key]) for key in ("x_m", "y_m"))
    return 1e3 * float(np.hypot(state.x_m - x_m, state.y_m - y_m))


def _row(what: str, value: float, reported: float | None, share: float) -> Row:
    if reported is None:
        return Row(what, "", f"{value:.1f} mm", None)
    limit = f"{reported:g} mm within {100 * share:.0f} %"
    return Row(what, limit, f"{value:.1f} mm", abs(value - reported) <= share * reported)


def _study(bench: Bench) -> list[Row]:
    study, out = studies()[STUDY], bench.folder / STUDY
    out.mkdir()
    began_s, cpu_s = time.monotonic(), time.process_time()
    reproduce(study, study.figures, out, lambda text, done: bench.say(f"{STUDY}: {text}"))
    took_s, used_s = time.monotonic() - began_s, time.process_time() - cpu_s
    measured = f"{took_s:.0f} s ({used_s:.0f} s of CPU)"
    return [Row(f"reproduce {STUDY}: whole run", f"{MOST_S:g} s", measured, took_s <= MOST_S)]
