"""Every kind of picture of the emulator's sky: time, rate and accuracy; the easy ones through JPEG too."""

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from bench.limits import plain
from bench.rows import Bench, Row
from bench.star.laboratory import CAMERA_FILE, CEILING_FILE, TAGS, Frame, Laboratory
from bench.star.report import rows_of
from bench.star.score import run
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import detect
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

SEED = 1
JPEG_QUALITY = 90
_WARM = 20


def measure(bench: Bench) -> list[Row]:
    """Lost in space, picture by picture, as ``star-tracker solve`` does."""
    tracker = StarTracker(StarCatalogue.load(CEILING_FILE), CameraCalibration.load(CAMERA_FILE))
    laboratory = Laboratory(SEED)
    frames: list[Frame] = []
    for tag in TAGS:
        bench.say(f"star: drawing {tag}")
        frames += laboratory.frames(tag, bench.frames)
    for frame in frames[:_WARM]:
        tracker.solve(detect(frame.image))
    rows = rows_of(run(frames, tracker.solve, bench.say), "star")
    for tag in ("easy", "blur"):
        squeezed = through_jpeg([frame for frame in frames if frame.tag == tag])
        score = run(squeezed, tracker.solve, bench.say)
        what = f"star, MJPEG quality {JPEG_QUALITY}, {tag}"
        rows += [
            plain(f"{what}: position RMS", score.position_mm(tag), "mm"),
            plain(f"{what}: heading RMS", score.heading_deg(tag), "deg"),
            plain(f"{what}: identified", score.rate(tag), "%", f"{score.false} false"),
        ]
    return rows


def through_jpeg(frames: Sequence[Frame]) -> list[Frame]:
    """The same pictures as a camera's MJPEG stream would bring them."""
    squeezed = []
    for frame in frames:
        _, data = cv2.imencode(".jpg", frame.image, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        image = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
        squeezed.append(replace(frame, image=np.asarray(image, dtype=np.uint8)))
    return squeezed
