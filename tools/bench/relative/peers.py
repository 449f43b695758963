"""Pose solvers on the same frames: ours, OpenCV's, scipy's, the published ones."""

import time
from collections.abc import Callable

import cv2
import numpy as np
from scipy.optimize import differential_evolution, least_squares
from scipy.spatial.transform import Rotation

from bench.limits import at_least, at_most, plain
from bench.relative.scenes import scenes
from bench.rows import Bench, Row
from groundstation.data_sets.relative_case import case_of
from groundstation.relative_navigation.evolution import EvolutionSettings
from groundstation.relative_navigation.evolved_pose import pixel_costs, search
from groundstation.relative_navigation.levenberg import solve_levenberg
from groundstation.relative_navigation.newton import solve_newton
from groundstation.relative_navigation.pose import Pose, Sight
from groundstation.relative_navigation.precession import AxialInertia
from groundstation.relative_navigation.rotations import turns
from groundstation.relative_navigation.stage_spin import LeavingCamera, Stage, StageRun, fit_stage

Solve = Callable[[np.ndarray, Rotation, np.ndarray], tuple[np.ndarray, np.ndarray] | None]

POSES = 200
SLOW_POSES = 40
SETTINGS = EvolutionSettings()


def measure(bench: Bench) -> list[Row]:
    """Every solver at 3 and at 15 m; evolution; the stage."""
    rows: list[Row] = []
    for distance in (3.0, 15.0):
        for name, solve in _solvers().items():
            bench.say(f"relative: {name} at {distance:g} m")
            rows.append(_row(name, solve, distance))
    return [*rows, *_evolution(bench), *_stage(bench)]


def _solvers() -> dict[str, Solve]:
    scene = scenes.Scene()
    camera = case_of(scene.case()).settings.camera
    matrix, points = scene.matrix[:, :3].copy(), scene.points_m.copy()

    def ours(solver: Callable[..., object]) -> Solve:
        def solve(
            pixels: np.ndarray, rotation: Rotation, position: np.ndarray
        ) -> tuple[np.ndarray, np.ndarray] | None:
            fit = solver(
                camera, points, Sight(np.arange(6), pixels, 1 / 0.3), Pose(rotation.as_matrix(), position)
            )
            return (fit.pose.camera_from_body, fit.pose.position_camera_m) if fit.converged else None

        return solve

    def opencv(flag: int, *, refines: bool = False, warm: bool = False) -> Solve:
        def solve(
            pixels: np.ndarray, rotation: Rotation, position: np.ndarray
        ) -> tuple[np.ndarray, np.ndarray] | None:
            begin = (
                (rotation.as_rotvec()[:, None], position[:, None].copy(), True)
                if warm
                else (None, None, False)
            )
            there, turn, place = cv2.solvePnP(points, pixels, matrix, None, *begin, flags=flag)
            if there and refines:
                turn, place = cv2.solvePnPRefineLM(points, pixels, matrix, None, turn, place)
            return (Rotation.from_rotvec(turn.ravel()).as_matrix(), place.ravel()) if there else None

        return solve

    def scipy_(
        pixels: np.ndarray, rotation: Rotation, position: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray] | None:
        def miss(x: np.ndarray) -> np.ndarray:
            seen = points @ Rotation.from_rotvec(x[3:]).as_matrix().T + x[:3]
            return (scene.f_px * seen[:, :2] / seen[:, 2:] + (scenes.CX, scenes.CY) - pixels).ravel()

        found = least_squares(miss, np.r_[position, rotation.as_rotvec()], method="lm")
        return Rotation.from_rotvec(found.x[3:]).as_matrix(), found.x[:3]

    return {
        "ours (Levenberg-Marquardt)": ours(solve_levenberg),
        "published Newton": ours(solve_newton),
        "OpenCV SQPNP": opencv(cv2.SOLVEPNP_SQPNP),
        "OpenCV SQPNP + LM": opencv(cv2.SOLVEPNP_SQPNP, refines=True),
        "OpenCV ITERATIVE, warm": opencv(cv2.SOLVEPNP_ITERATIVE, warm=True),
        "OpenCV ITERATIVE, cold": opencv(cv2.SOLVEPNP_ITERATIVE),
        "scipy least_squares": scipy_,
    }


def _row(name: str, solve: Solve, distance: float) -> Row:
    rng, scene = np.random.default_rng(12), scenes.Scene()
    off, bounds, spent, wrong = [], [], [], 0
    for _ in range(POSES):
        rotation = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, 3))
        position = np.array([*rng.uniform(-0.08, 0.08, 2) * distance, distance])
        pixels = scene.pixels(rotation, position) + rng.normal(0.0, 0.3, (6, 2))
        start = Rotation.from_rotvec(rng.normal(0.0, 0.03, 3)) * rotation
        begin = time.process_time()
        found = solve(pixels, start, 1.02 * position)
        spent.append(1e3 * (time.process_time() - begin))
        angle = np.inf if found is None else (Rotation.from_matrix(found[0]) * rotation.inv()).magnitude()
        if found is None or angle > np.radians(10.0):
            wrong += 1
            continue
        off.append((np.linalg.norm(found[1] - position), angle))
        bound = scenes.bound(scene, rotation, position)
        bounds.append((np.trace(bound[:3, :3]), np.trace(bound[3:, 3:])))
    ratio = np.sqrt(np.mean(np.square(off), axis=0) / np.mean(bounds, axis=0))
    note = f"{np.median(spent):.3f} ms, {wrong} of {POSES} wrong"
    what = f"relative, {name} at {distance:g} m: position / turn error over the bound"
    if name.startswith("ours"):
        return at_most(what, ratio.tolist(), (1.1, 1.1), (1.03, 1.03), note=note)
    return plain(what, ratio.tolist(), "", note)


def _evolution(bench: Bench) -> list[Row]:
    """One frame by the published search: ours, and plain scipy with the same settings on the same cost."""
    bench.say("relative: differential evolution")
    rng, scene = np.random.default_rng(5), scenes.Scene()
    camera = case_of(scene.case()).settings.camera
    half = np.full(3, 0.3)
    ours_ms, scipy_ms, gaps = [], [], []
    for _ in range(8):
        rotation = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, 3))
        pixels = scene.pixels(rotation, np.array([0.1, -0.1, 5.0])) + rng.normal(0.0, 0.3, (6, 2))
        around = (Rotation.from_rotvec(rng.uniform(-0.15, 0.15, 3)) * rotation).as_matrix()
        begin = time.process_time()
        found = search(camera, scene.points_m, pixels, around, half, SETTINGS, rng)
        ours_ms.append(1e3 * (time.process_time() - begin))

        def cost(x: np.ndarray, pixels: np.ndarray = pixels, around: np.ndarray = around) -> float:
            return float(pixel_costs(camera, scene.points_m, pixels, turns(x[None]) @ around)[0])

        begin = time.process_time()
        other = differential_evolution(
            cost,
            list(zip(-half, half, strict=True)),
            strategy="rand1bin",
            popsize=SETTINGS.population // 3 + 1,
            mutation=SETTINGS.weight,
            recombination=SETTINGS.crossover,
            maxiter=SETTINGS.generations,
            tol=SETTINGS.accuracy,
            polish=False,
            init="random",
            rng=rng,
        )
        scipy_ms.append(1e3 * (time.process_time() - begin))
        gaps.append(abs(found.cost - other.fun) / other.fun)
    times = float(np.median(scipy_ms) / np.median(ours_ms))
    note = (
        f"{np.median(ours_ms):.1f} ms against {np.median(scipy_ms):.0f} ms; "
        f"population {SETTINGS.population}, F {SETTINGS.weight}, CR {SETTINGS.crossover}, "
        f"at most {SETTINGS.generations} generations"
    )
    return [
        at_least(
            "relative, differential evolution: times faster than scipy's rand1bin",
            times,
            5.0,
            20.0,
            note=note,
        ),
        at_most(
            "relative, differential evolution: costs apart, largest", max(gaps), 1e-3, unit="of the cost"
        ),
    ]


def _stage(bench: Bench) -> list[Row]:
    """Three frames at 1 px: rms over the bound of reference 4.4, all axes together."""
    ring = [
        [-0.35 * (k % 2 == 0), 1.25 * np.cos(k * np.pi / 3), 1.25 * np.sin(k * np.pi / 3)] for k in range(6)
    ]
    markers, inertia = np.array(ring), np.array([2548.0, 14406.0, 14406.0])
    stage = Stage(AxialInertia(2548.0, 14406.0), markers, LeavingCamera(600.0, 2.0, 1.0))
    rate, times = np.radians([-2.5, 1.0, 1.0]), np.array([0.0, 0.5, 1.0])
    rotations, _ = scenes.spin(times, Rotation.identity(), rate, inertia)
    exact = []
    for t, rotation in zip(times, rotations, strict=True):
        x, y, z = rotation.apply(markers).T
        exact.append(np.stack((600.0 * y / (2.0 + t - x), 600.0 * z / (2.0 + t - x)), axis=1))
    pixels, rng = np.concatenate(exact), np.random.default_rng(9)
    errors = []
    for run in range(500):
        if run % 50 == 0:
            bench.say(f"relative: stage, {run} of 500 runs")
        noisy = StageRun(
            np.repeat(times, 6), np.tile(np.arange(6), 3), pixels + rng.normal(0.0, 1.0, pixels.shape)
        )
        errors.append(np.degrees(fit_stage(stage, noisy, 1.0).rate_rad_s - rate))
    bound = np.array([0.11654424951342725, 0.2611701307136767, 0.2621200689172417])
    ratio = np.sqrt(np.mean(np.square(errors), axis=0)) / bound
    what = "relative, stage rates of three frames at 1 px: rms over the bound, x / y / z"
    return [at_most(what, ratio.tolist(), (1.15, 1.15, 1.15), (1.05, 1.05, 1.05), note="500 runs")]
