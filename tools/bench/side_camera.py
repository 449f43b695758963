"""One mock-up seen by another one's side camera: pictures at 1.5 m, and followers that fly by them, live.

The plain body is looked at with the sun lamp all around, but where the camera looks into it. Live flights
are of the example scenarios at 1.5 m, the leader driving: errors of each sighting and of the kept distance
against truth, from 15 s after the follower flies.
"""

import math
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.rows import RIGS, ROOT, Bench, Row
from bench.unit import blur_s, picture
from firmware_emulator.side_view.scene import read_hulls, read_side_camera
from firmware_emulator.side_view.side_view import SideView, SunLamp
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.relative_navigation.messages import LeaderState, RelativePose
from groundstation.recording.reader import Recording
from groundstation.relative_navigation.side_bodies import load_side_bodies
from groundstation.relative_navigation.side_camera import SideCamera
from groundstation.relative_navigation.side_looks import LOOKS
from groundstation.relative_navigation.sighting import Seen

Floats = NDArray[np.float64]

FILES = ROOT / "calibration" / "rigs" / "emulated"
RANGE_M, MOST = 1.5, 200
LIMITS = {"markers": (3.0, 0.2), "lit_part": (10.0, 1.0)}
"""Distance (mm) and bearing (deg), RMS."""
WORDS = {"markers": "markers", "lit_part": "plain, lit part"}
FOLLOWER_MM = 12.0
SETTLED_S = 15.0
SCENARIOS = {"markers": "follow_by_side_camera.toml", "lit_part": "follow_lit_leader.toml"}
HERE = (0.0, 0.0, 0.0)


def measure(bench: Bench) -> list[Row]:
    """Pictures of both kinds, then a live flight by each."""
    rows: list[Row] = []
    for by, name in (("markers", "alpha"), ("lit_part", "gamma")):
        bench.say(f"side camera, pictures, {WORDS[by]}")
        rows += _of_pictures(by, name, min(bench.frames, MOST))
    for by in LIMITS:
        bench.say(f"side camera, live, {WORDS[by]}")
        rows += _of_flight(by, _fly(bench, by))
    return rows


def _of_pictures(by: str, name: str, frames: int) -> Iterator[Row]:
    camera = SideCamera.load(FILES / "side_camera.json")
    bodies = {body.vehicle: body for body in load_side_bodies(FILES / "side_bodies.toml")}
    look, rng, grey = LOOKS[by](camera, bodies[name]), np.random.default_rng(81), picture()
    optics, hulls = read_side_camera(FILES / "side_camera.json"), read_hulls(FILES / "side_bodies.toml")
    off, squares, cpu_s, unit_s = [], [], [], []
    for number in range(frames):
        lamp = SunLamp(math.pi + math.radians(rng.uniform(-140.0, 140.0)), 0.25)
        view = SideView(optics, hulls, lamp, np.random.SeedSequence((82, number)))
        bearing, heading = rng.uniform(-0.12, 0.12), rng.uniform(-math.pi, math.pi)
        pose = (RANGE_M * math.cos(bearing), RANGE_M * math.sin(bearing), heading)
        drawn = view.render((HERE, HERE), {name: (pose, pose)}, number)
        begin_s = time.process_time()
        seen = look(drawn)
        cpu_s.append(time.process_time() - begin_s)
        unit_s.append(blur_s(grey))
        if isinstance(seen, Seen):
            turn = math.remainder(seen.heading_rad - heading, math.tau)
            off.append((seen.range_m - RANGE_M, seen.bearing_rad - bearing, turn))
            error = np.array([*(seen.position_body_m - pose[:2]), turn])
            count = 2 if math.isnan(turn) else 3
            inside = seen.covariance[:count, :count]
            squares.append(float(error[:count] @ np.linalg.solve(inside, error[:count])) / count)
    what = f"side camera, {WORDS[by]}, pictures at 1.5 m"
    share = len(off) / frames
    yield Row(f"{what}: found", "95 %", f"{100 * share:.1f} %", share >= 0.95)
    yield from _accuracy(what, by, np.array(off))
    ratio = float(np.mean(squares))
    yield Row(f"{what}: chi-square over its freedom", "0.2 to 2", f"{ratio:.2f}", 0.2 <= ratio <= 2.0)
    middle_s = float(np.median(cpu_s))
    units = middle_s / float(np.median(unit_s))
    yield Row(
        f"{what}: CPU per picture", "", f"{1e3 * middle_s:.1f} ms, {units:.0f} blurs of 640 x 480", None
    )


def _accuracy(what: str, by: str, off: Floats) -> Iterator[Row]:
    rms = np.sqrt(np.mean(np.square(off), axis=0))
    range_mm, bearing_deg, heading_deg = 1e3 * rms[0], math.degrees(rms[1]), math.degrees(rms[2])
    limit_mm, limit_deg = LIMITS[by]
    yield Row(f"{what}: distance RMS", f"{limit_mm:g} mm", f"{range_mm:.2f} mm", bool(range_mm <= limit_mm))
    yield Row(
        f"{what}: bearing RMS", f"{limit_deg:g} deg", f"{bearing_deg:.3f} deg", bool(bearing_deg <= limit_deg)
    )
    if not math.isnan(heading_deg):
        yield Row(f"{what}: heading RMS", "", f"{heading_deg:.3f} deg", None)


def _fly(bench: Bench, by: str) -> Path:
    """A live flight of the example scenario at 1.5 m, the leader driving along the table; its recording."""
    text = (ROOT / "examples" / "scenarios" / SCENARIOS[by]).read_text()
    for old, new in (
        ('rig = "../rigs', f'rig = "{RIGS.as_posix()}'),
        ("distance_m = 1.0", f"distance_m = {RANGE_M}"),
        ("y_m = 0.4", "y_m = 0.9"),
        (", [0.9, 0.2]]", "]"),
        ("duration_s = 70.0", "duration_s = 50.0"),
    ):
        text = text.replace(old, new)
    scenario, path = bench.folder / f"side_{by}.toml", bench.folder / f"side_{by}.mcap"
    scenario.write_text(text)
    words = ["run", str(scenario), "--headless", "--no-console", "--record", str(path)]
    command = [sys.executable, "-m", "groundstation", *words]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            bench.say(f"live: {line.strip()[:100]}")
    if process.returncode not in (0, 1):  # 1: a limit of the scenario, which is a row here
        raise RuntimeError(f"{' '.join(command)} ended with code {process.returncode}")
    return path


def _of_flight(by: str, path: Path) -> Iterator[Row]:
    with Recording(path) as recording:
        truth = {name: _truth(recording, name) for name in ("alpha", "beta")}
        poses: list[Any] = [entry.payload for entry in recording.messages([RelativePose], ["beta"])]
    with Recording(path) as recording:  # the leader's motion is known from when the follower flies
        flown: list[Any] = [entry.payload for entry in recording.messages([LeaderState], ["beta"])]
    from_ns = flown[0].stamp_ns + SETTLED_S * 1e9
    poses = [pose for pose in poses if pose.stamp_ns >= from_ns]
    off = [_error(pose, truth) for pose in poses if pose.status == "solved"]
    what = f"side camera, {WORDS[by]}, live at 1.5 m"
    share = len(off) / len(poses)
    yield Row(f"{what}: pictures that show it", "95 %", f"{100 * share:.1f} % of {len(poses)}", share >= 0.95)
    if not off:
        return
    yield from _accuracy(what, by, np.array(off))
    own, other = truth["beta"], truth["alpha"]
    rows = own[own[:, 0] >= from_ns]
    there = np.column_stack([np.interp(rows[:, 0], other[:, 0], other[:, index]) for index in (1, 2)])
    apart_mm = 1e3 * (np.hypot(*(there - rows[:, 1:3]).T) - RANGE_M)
    kept_mm = float(np.sqrt(np.mean(apart_mm**2)))
    yield Row(
        f"{what}: follower's distance error RMS",
        f"{FOLLOWER_MM:g} mm",
        f"{kept_mm:.2f} mm",
        kept_mm <= FOLLOWER_MM,
    )


def _truth(recording: Recording, vehicle: str) -> Floats:
    """Rows of stamp (ns), x, y (m), heading (rad, unwrapped)."""
    found: list[Any] = [entry.payload for entry in recording.messages([ReferenceState], [vehicle])]
    rows = np.array([(row.stamp_ns, *row.position_table_m, row.heading_rad) for row in found], dtype=float)
    rows[:, 3] = np.unwrap(rows[:, 3])
    return rows


def _error(pose: Any, truth: dict[str, Floats]) -> tuple[float, float, float]:  # noqa: ANN401 - as recorded
    own, other = (
        [np.interp(pose.stamp_ns, truth[name][:, 0], truth[name][:, index]) for index in (1, 2, 3)]
        for name in ("beta", "alpha")
    )
    dx, dy = other[0] - own[0], other[1] - own[1]
    bearing_rad = math.atan2(dy, dx) - own[2]
    return (
        pose.range_m - math.hypot(dx, dy),
        math.remainder(pose.bearing_body_rad - bearing_rad, math.tau),
        math.remainder(pose.relative_heading_rad - other[2] + own[2], math.tau),
    )
