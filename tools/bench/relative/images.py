"""Rendered tips of 24 mm, f 750 px: centres, poses from pictures, and the time of a whole frame."""

import time

import numpy as np
from scipy.spatial.transform import Rotation

from bench.limits import at_most, plain
from bench.relative.scenes import pictures, scenes
from bench.rows import Bench, Row
from bench.unit import blur_s
from groundstation.data_sets.relative_case import case_of
from groundstation.relative_navigation.levenberg import solve_levenberg
from groundstation.relative_navigation.motion_models import MOTION_MODELS
from groundstation.relative_navigation.pose import Pose, Sight
from groundstation.relative_navigation.solvers import SOLVERS
from groundstation.relative_navigation.spots import SpotFinder, SpotSettings, look_for_spots
from groundstation.relative_navigation.tracker_settings import Frame

TIP_M = 0.024
NEAR_M = (3.0, 5.0, 8.0, 10.0, 12.0)
POSES = {3.0: ((0.3, 0.01), (0.2, 0.007)), 15.0: ((25.0, 0.25), (15.0, 0.15))}
"""Distance to limits and aims, mm and deg."""
SHOTS = 40


def measure(bench: Bench) -> list[Row]:
    """Every row."""
    rng = np.random.default_rng(3)
    near = np.concatenate([_centres(bench, rng, distance, "grey")[0] for distance in NEAR_M])
    far = _centres(bench, rng, 15.0, "grey")[0]
    rows = [
        at_most(
            "relative, centres of tips up to 12 m / at 15 m, rms",
            (_rms(near), _rms(far)),
            (0.05, 0.1),
            (0.03, 0.07),
            "px",
        )
    ]
    published = [_rms(_centres(bench, rng, distance, "contour")[0]) for distance in (3.0, 15.0)]
    rows.append(plain("relative, published contour mean at 3 m / 15 m", published, "px"))
    for distance, (must, aim) in POSES.items():
        errors = _centres(bench, rng, distance, "grey")[1]
        found = 1e3 * _rms(errors[:, :3]), float(np.degrees(_rms(errors[:, 3:])))
        rows.append(
            at_most(f"relative, pose from pictures at {distance:g} m, rms", found, must, aim, "mm, deg")
        )
    return [*rows, *_times(bench, rng)]


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(errors), axis=1))))


def _centres(
    bench: Bench, rng: np.random.Generator, distance: float, method: str
) -> tuple[np.ndarray, np.ndarray]:
    """Errors of centres (n, 2), and of the poses solved from them (m, 6)."""
    bench.say(f"relative: pictures at {distance:g} m, {method}")
    scene = scenes.Scene()
    camera = case_of(scene.case()).settings.camera
    finder = SpotFinder(SpotSettings(method=method))
    looked = (
        [finder.look]
        if method == "grey"
        else [lambda picture: look_for_spots(picture, SpotSettings(method=method))]
    )
    if method == "grey":  # it has seen the tips come near, as a tracker has
        near, radii = pictures.tips(scene, Rotation.identity(), np.array([0, 0, 4.0]), TIP_M)
        finder.look(pictures.paint(near, radii, rng))
    off, poses = [], []
    for _ in range(SHOTS):
        rotation = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3))
        position = np.array([*rng.uniform(-0.02, 0.02, 2) * distance, distance])
        pixels, radii = pictures.tips(scene, rotation, position, TIP_M)
        seen = looked[0](pictures.paint(pixels, radii, rng)).centres
        gaps = np.linalg.norm(pixels[:, None] - seen.pixels[None], axis=2)
        nearest = gaps.argmin(axis=1)
        good = np.flatnonzero(gaps.min(axis=1) < 2.0)
        off.append(seen.pixels[nearest[good]] - pixels[good])
        start = Pose(rotation.as_matrix(), position)
        weights = np.linalg.cholesky(np.linalg.inv(seen.covariances[nearest[good]])).transpose(0, 2, 1)
        fit = solve_levenberg(camera, scene.points_m, Sight(good, seen.pixels[nearest[good]], weights), start)
        poses.append(fit.pose.minus(start))
    return np.concatenate(off), np.array(poses)


def _times(bench: Bench, rng: np.random.Generator) -> list[Row]:
    """CPU time from the decoded picture to the answer; and of the solver alone."""
    scene, motion = scenes.Scene(), scenes.leaving(2, np.arange(0.0, 480.0, 4.0))
    shots = []
    for rotation, position in zip(motion.rotations, motion.positions_m, strict=True):
        shots.append(pictures.paint(*pictures.tips(scene, rotation, position, TIP_M), rng))
    case = case_of(scene.case(labelled=False, guess_frame0=scenes.guess(motion, rng)))
    rows, blur = [], []
    for name in ("none", "hill-euler"):
        bench.say(f"relative: whole frames, {name}")
        finder, tracker = SpotFinder(), MOTION_MODELS[name](case.settings, SOLVERS["lm"]())
        spent = []
        for number, (t, shot) in enumerate(zip(motion.times_s.tolist(), shots, strict=True)):
            begin = time.process_time()
            tracker.look(Frame(number, t, finder.look(shot).centres))
            spent.append(1e3 * (time.process_time() - begin))
            blur.append(blur_s(shot))
        times = np.percentile(spent[3:], (50, 95))
        note = f"{times[0] / (1e3 * float(np.median(blur))):.1f} blurs"
        title = f"relative, whole frame of 640 x 480, {name}: CPU, median / p95"
        rows.append(at_most(title, times.tolist(), (1.0, 3.0), (0.6, 1.5), "ms", note))
    spent = []
    for rotation, position in zip(motion.rotations, motion.positions_m, strict=True):
        pixels = scene.pixels(rotation, position) + rng.normal(0.0, 0.3, (6, 2))
        start = Pose((Rotation.from_rotvec(rng.normal(0, 0.01, 3)) * rotation).as_matrix(), 1.005 * position)
        begin = time.process_time()
        solve_levenberg(case.settings.camera, scene.points_m, Sight(np.arange(6), pixels, 1 / 0.3), start)
        spent.append(1e3 * (time.process_time() - begin))
    rows.append(at_most("relative, solve 6 points: CPU, median", float(np.median(spent)), 0.4, 0.1, "ms"))
    return rows
