"""A hall of ten thousand LEDs, the catalogue and the lens made from the stars, a rolling shutter."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bench.limits import at_most, between, plain
from bench.rows import Bench, Row
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, Laboratory, spots_at
from bench.star.score import run
from bench.unit import blur_s, picture
from calibration.sky.self_calibration import calibrate_intrinsics
from calibration.sky.survey.surveyed_sky import Anchor, survey
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Spots, detect
from groundstation.star_tracking.fixes import BodyMotion, PictureFix
from groundstation.star_tracking.projection import project
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker, TrackerSettings

LEDS = 10_000
LEDS_M2 = 9.0
"""As dense as the emulator's ceiling."""
HALL_PICTURES = 100
SWEEP = (6, 12)
"""Lines of the sweep and pictures on each."""
TAPE_STD_M = 1e-3
READOUT_S, SPEED_M_S = 0.025, 0.5
PICTURES = 40


def measure(bench: Bench) -> list[Row]:
    """Rows of all four."""
    camera, catalogue = CameraCalibration.load(CAMERA_FILE), StarCatalogue.load(CEILING_FILE)
    laboratory = Laboratory(2)
    bench.say("star: ten thousand LEDs")
    rows = _many_leds(camera)
    bench.say("star: survey from a sweep")
    rows += _survey(laboratory, camera)
    bench.say("star: lens from the stars")
    rows += _lens(laboratory, camera, catalogue)
    bench.say("star: rolling shutter")
    return [*rows, _rolling_shutter(laboratory, camera, catalogue)]


def _many_leds(camera: CameraCalibration) -> list[Row]:
    """Spots of a hall, one in twenty LEDs dark; identification only."""
    rng = np.random.default_rng(6)
    side = np.sqrt(LEDS / LEDS_M2)
    leds = rng.uniform(0.0, side, (LEDS, 2))
    tracker = StarTracker(StarCatalogue.from_positions(leds), camera)
    image = picture()
    times_ms: list[float] = []
    units_ms: list[float] = []
    found = 0
    for _ in range(HALL_PICTURES):
        pose = np.array([*rng.uniform(2.0, side - 2.0, 2), rng.uniform(-np.pi, np.pi)])
        near = leds[np.hypot(*(leds - pose[:2]).T) < 1.6]
        uv, _ = project(camera, np.tile(pose, (len(near), 1)), near)
        inside = (uv > 4).all(axis=1) & (uv < (camera.width - 5, camera.height - 5)).all(axis=1)
        uv = uv[inside & (rng.random(len(uv)) > 0.05)]
        spots = spots_at(uv + rng.normal(0.0, 0.03, uv.shape))
        units_ms.append(1e3 * blur_s(image))
        begin = time.process_time()
        answer = tracker.solve(spots)
        times_ms.append(1e3 * (time.process_time() - begin))
        found += (
            isinstance(answer, PictureFix) and np.hypot(answer.x_m - pose[0], answer.y_m - pose[1]) < 0.02
        )
    median, unit = float(np.median(times_ms)), float(np.median(units_ms))
    note = f"{median / unit:.3g} units of {unit:.3f} ms"
    return [
        at_most("star: 10,000 LEDs, identification median", median, 6.0, 2.0, "ms", note),
        plain("star: 10,000 LEDs, identified", 100.0 * found / HALL_PICTURES, "%", f"of {HALL_PICTURES}"),
    ]


def _survey(laboratory: Laboratory, camera: CameraCalibration) -> list[Row]:
    """A sweep of 72 pictures, three LEDs measured by tape, the height 10 % off."""
    pictures, poses = _sweep(laboratory)
    tracker = StarTracker(StarCatalogue.from_positions(laboratory.leds), camera)
    rng, anchors = np.random.default_rng(9), []
    for frame in (20, 40, 60):
        fix = tracker.solve(pictures[frame])
        if not isinstance(fix, PictureFix):
            raise RuntimeError(f"picture {frame} of the sweep has no fix to click a star in: {fix.detail}")
        spot, star = fix.spot_index[0], int(fix.star_index[0])
        tape = laboratory.leds[star] + rng.normal(0.0, TAPE_STD_M, 2)
        click = (pictures[frame].u_px[spot] + 2.0, pictures[frame].v_px[spot] - 2.0)
        anchors.append(Anchor(str(star), *tape, frame, *click))
    sky = survey(pictures, anchors, camera.with_height(1.1 * camera.ceiling_height_above_camera_m))
    found, true = sky.star_m @ [1, 1j], laboratory.leds @ [1, 1j]
    distance = np.abs(found[:, None] - true)
    goal = true[distance.argmin(axis=1)]
    real = distance.min(axis=1) < 0.03
    centred, wanted = found[real] - found[real].mean(), goal[real] - goal[real].mean()
    similarity = (wanted * np.conj(centred)).sum() / (np.abs(centred) ** 2).sum()
    error = similarity * centred - wanted
    rms_mm = 1e3 * float(np.sqrt((np.abs(error) ** 2).mean()))
    ratio = float(np.sqrt(np.mean((np.column_stack((error.real, error.imag)) / sky.sigma_m[real]) ** 2)))
    note = f"{int(real.sum())} of {len(true)} LEDs, {int((~real).sum())} others, {len(poses)} pictures"
    return [
        at_most("star: survey of the LEDs, RMS after the best similarity", rms_mm, 0.3, 0.1, "mm", note),
        between("star: survey, errors over reported std", ratio, 1 / 1.5, 1.5, "0.83-1.2"),
    ]


def _sweep(laboratory: Laboratory) -> tuple[list[Spots], list[NDArray[np.float64]]]:
    rng, heading = np.random.default_rng(8), 0.0
    leds, (lines, each) = laboratory.leds, SWEEP
    low, high = leds.min(axis=0) + 0.6, leds.max(axis=0) - 0.6
    pictures: list[Spots] = []
    poses: list[NDArray[np.float64]] = []
    for number, y in enumerate(np.linspace(low[1], high[1], lines)):
        xs = np.linspace(low[0], high[0], each)
        for x in xs if number % 2 == 0 else xs[::-1]:
            heading += 0.11
            pose = np.array([x + rng.normal(0, 0.02), y + rng.normal(0, 0.02), heading])
            pictures.append(detect(laboratory.picture(pose, rng.uniform(-0.05, 0.05, 3))))
            poses.append(pose)
    return pictures, poses


def _lens(laboratory: Laboratory, camera: CameraCalibration, catalogue: StarCatalogue) -> list[Row]:
    """A turn in place; the first guess knows no distortion and 3 % less focal length."""
    middle = laboratory.leds.mean(axis=0)
    headings = np.linspace(0.0, 2 * np.pi, 36)
    pictures = [detect(laboratory.picture((*middle, heading))) for heading in headings]
    wrong = replace(
        camera,
        fx=0.97 * camera.fx,
        fy=0.97 * camera.fy,
        cx=0.5 * (camera.width - 1),
        cy=0.5 * (camera.height - 1),
        distortion=(0.0, 0.0, 0.0, 0.0, 0.0),
    )
    found = calibrate_intrinsics(pictures, catalogue, wrong, wobble_sigma_m=2e-5)
    frames = list(laboratory.frames("easy", PICTURES))
    known = run(frames, StarTracker(catalogue, camera).solve).position_mm("easy")
    ours = run(frames, StarTracker(catalogue, found.camera).solve).position_mm("easy")
    what = "star: self-calibrated lens"
    return [
        at_most(f"{what}, reprojection RMS", found.adjusted.rms_px, 0.1, 0.05, "px"),
        at_most(f"{what}, position error over that of the true lens", ours / known, 2.0, 1.2),
    ]


def _rolling_shutter(laboratory: Laboratory, camera: CameraCalibration, catalogue: StarCatalogue) -> Row:
    """Rows read one after another; the velocity is known, as from the fusion."""
    tracker = StarTracker(catalogue, camera, TrackerSettings(exposure_s=0.01, readout_s=READOUT_S))
    errors: list[float] = []
    for pose in laboratory.poses(PICTURES):
        way = laboratory.rng.uniform(-np.pi, np.pi)
        velocity = (SPEED_M_S * np.cos(way), SPEED_M_S * np.sin(way), laboratory.rng.uniform(-0.5, 0.5))
        fix = tracker.solve(
            detect(laboratory.picture(pose, velocity, 0.01, READOUT_S)), motion=BodyMotion(*velocity)
        )
        is_fix = isinstance(fix, PictureFix)
        errors.append(np.hypot(fix.x_m - pose[0], fix.y_m - pose[1]) if is_fix else np.nan)
    return at_most(
        "star: rolling shutter 25 ms at 0.5 m/s, velocity known, position RMS",
        1e3 * _rms(errors),
        0.5,
        0.3,
        "mm",
        f"{sum(np.isfinite(errors))} of {len(errors)} pictures",
    )


def _rms(errors: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))
