"""Folders of demo data are written here, in the formats that commands read."""

import csv
import json
from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_emulator.overhead.optics import OverheadOptics
from firmware_emulator.sky.optics import CameraOptics


def write_table(path: Path, columns: str, rows: Iterable[Sequence[object]]) -> None:
    """Write a CSV table; ``columns`` as its header states them."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns.split(","))
        writer.writerows(rows)


def write_json(path: Path, values: object) -> None:
    """Write a JSON file."""
    path.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8")


def write_frame(folder: Path, number: int, picture: NDArray[np.uint8]) -> str:
    """Write a picture into ``frames`` of a folder; return its name."""
    frames = folder / "frames"
    frames.mkdir(exist_ok=True)
    name = f"{number:05d}"
    (frames / f"{name}.png").write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    return name


def star_camera_keys(optics: CameraOptics) -> dict[str, object]:
    """What ``camera.json`` of a star camera holds."""
    return _lens(optics) | {
        "ceiling_height_above_camera_m": optics.ceiling_height_m,
        "mount_offset_body_m": [*optics.offset_body_m, 0.0],
        "mount_yaw_rad": optics.yaw_rad,
        "mount_tilt_x_rad": optics.tilt_x_rad,
        "mount_tilt_y_rad": optics.tilt_y_rad,
    }


def overhead_camera_keys(optics: OverheadOptics) -> dict[str, object]:
    """What ``camera.json`` of the camera over the table holds."""
    return _lens(optics) | {
        "position_table_m": list(optics.position_m),
        "yaw_rad": optics.yaw_rad,
        "tilt_x_rad": optics.tilt_x_rad,
        "tilt_y_rad": optics.tilt_y_rad,
    }


def _lens(optics: CameraOptics | OverheadOptics) -> dict[str, object]:
    return {
        "width": optics.width_px,
        "height": optics.height_px,
        "fx": optics.focal_px[0],
        "fy": optics.focal_px[1],
        "cx": optics.centre_px[0],
        "cy": optics.centre_px[1],
        "dist_k1_k2_p1_p2_k3": list(optics.distortion),
    }
