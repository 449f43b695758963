"""How well mock-ups are found from above: accuracy, truth of the covariance, CPU time; emulated pictures."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.rows import ROOT, Bench, Row
from bench.unit import blur_s, picture
from firmware_emulator.overhead.scene import read_markings, read_overhead_camera
from firmware_emulator.overhead.table_view import Body, Light, TableView
from groundstation.overhead.circle_tracker import OverheadFix, OverheadTracker
from groundstation.overhead.liveries import load_liveries
from groundstation.overhead.overhead_camera import OverheadCamera

FILES = ROOT / "calibration" / "rigs" / "emulated"
KINDS = (("at rest", 0.0, 0, 0.3), ("0.5 m/s, 10 ms", 0.0025, 0, 0.3), ("JPEG 95", 0.0, 95, 0.6))
"""What, sigma of half the way during the exposure (m), JPEG quality (0: raw), position limit (mm)."""

MOST = 60
"""Pictures of a kind: enough for figures that hold to a tenth, at 30 ms to draw and 20 ms to solve each."""


@dataclass
class Found:
    """What was measured of one kind of pictures."""

    off: list[NDArray[np.float64]] = field(default_factory=list)
    ratios: list[float] = field(default_factory=list)
    looked: int = 0
    cpu_s: list[float] = field(default_factory=list)
    unit_s: list[float] = field(default_factory=list)


def measure(bench: Bench) -> list[Row]:
    """Measure every kind on pictures of two mock-ups each."""
    bodies = {name: Body(marks, 0.2) for name, marks in read_markings(FILES / "circles.toml").items()}
    optics = read_overhead_camera(FILES / "overhead_camera.json")
    view = TableView(optics, (-2.0, 2.0, -1.5, 1.5), bodies, Light(), np.random.SeedSequence(77))
    tracker = OverheadTracker(
        OverheadCamera.load(FILES / "overhead_camera.json"), load_liveries(FILES / "circles.toml")
    )
    rows: list[Row] = []
    for what, half_m, quality, limit_mm in KINDS:
        bench.say(f"from above, {what}")
        rows += _rows(what, _look(view, tracker, min(bench.frames, MOST), half_m, quality), limit_mm)
    return rows


def _look(view: TableView, tracker: OverheadTracker, frames: int, half_m: float, quality: int) -> Found:
    rng, found, grey = np.random.default_rng(78), Found(), picture()
    for sequence in range(frames):
        poses = np.array([
            (rng.uniform(low, high), rng.uniform(-1.2, 1.2), rng.uniform(-3.1, 3.1))
            for low, high in ((-1.7, -0.25), (0.25, 1.7))
        ])  # fmt: skip
        half = rng.normal(0.0, half_m, (2, 3))
        paths = {
            name: (tuple(pose - way), tuple(pose + way))
            for name, pose, way in zip(("alpha", "beta"), poses, half, strict=True)
        }
        image = view.render(paths, sequence)
        if quality:
            coded = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
            image = np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), np.uint8)
        begin_s = time.process_time()
        answers = tracker.look(image)
        found.cpu_s.append(time.process_time() - begin_s)
        found.unit_s.append(blur_s(grey))
        for answer, pose in zip(answers, poses, strict=True):
            found.looked += 1
            if isinstance(answer, OverheadFix):
                off = np.array([answer.x_m, answer.y_m, answer.heading_rad]) - pose
                off[2] = np.angle(np.exp(1j * off[2]))
                found.off.append(off)
                found.ratios.append(float(off @ np.linalg.solve(answer.covariance, off)) / 3.0)
    return found


def _rows(what: str, found: Found, limit_mm: float) -> Iterator[Row]:
    rms = np.sqrt(np.mean(np.square(found.off), axis=0))
    position_mm, heading_deg = 1e3 * float(np.hypot(rms[0], rms[1])), float(np.degrees(rms[2]))
    share = len(found.off) / found.looked
    ratio = float(np.mean(found.ratios))
    name = f"overhead, {what}"
    yield Row(f"{name}: mock-ups found", "99 %", f"{100 * share:.1f} %", share >= 0.99)
    yield Row(f"{name}: position RMS", f"{limit_mm:g} mm", f"{position_mm:.3f} mm", position_mm <= limit_mm)
    limit_deg = limit_mm / 3.0
    yield Row(
        f"{name}: heading RMS", f"{limit_deg:g} deg", f"{heading_deg:.3f} deg", heading_deg <= limit_deg
    )
    yield Row(f"{name}: chi-square / 3", "0.5 to 2", f"{ratio:.2f}", 0.5 <= ratio <= 2.0)
    cpu_s = float(np.median(found.cpu_s))
    units = cpu_s / float(np.median(found.unit_s))
    yield Row(f"{name}: CPU per picture", "", f"{1e3 * cpu_s:.1f} ms, {units:.0f} blurs of 640 x 480", None)
