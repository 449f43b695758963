"""A recorded data set with truth: the rows of the emulator's pictures, for others' pictures."""

import csv

import cv2
import numpy as np

from bench.rows import Bench, Row
from bench.star.laboratory import Frame
from bench.star.report import rows_of
from bench.star.score import run
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

KINDS = {"edge-of-table": "edge", "not-the-ceiling": "dark"}
"""Tags of the data sets that are named otherwise here."""
FEW = "3 stars"
_STARS = 4


def measure(bench: Bench) -> list[Row]:
    """All frames of the folder, decoded before the clock starts."""
    folder = bench.data
    assert folder is not None, "tools/bench.py asks for it"
    camera = CameraCalibration.load(folder / "camera.json")
    tracker = StarTracker(StarCatalogue.load(folder / "ceiling.csv"), camera)
    frames = []
    with (folder / "truth.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            image = cv2.imread(str(folder / "frames" / f"{row['frame']}.png"), cv2.IMREAD_GRAYSCALE)
            pose = (float(row["x_m"]), float(row["y_m"]), float(row["heading_rad"]))
            is_ceiling = row["has_fix"] == "1"
            frames.append(Frame(_kind(row), np.asarray(image, dtype=np.uint8), pose if is_ceiling else None))
    for frame in frames[:_STARS]:
        tracker.solve(detect(frame.image))  # warm
    return rows_of(run(frames, tracker.solve, bench.say), folder.name)


def _kind(row: dict[str, str]) -> str:
    tag = row["tags"].split(";")[0]
    if tag == "sparse" and int(row["visible_stars"]) < _STARS:
        return FEW
    return KINDS.get(tag, tag)
