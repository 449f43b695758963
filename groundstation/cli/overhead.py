"""``groundstation star-tracker overhead``: mock-ups found in pictures of the camera over the table."""

import time
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer

from groundstation.cli.progress import with_progress
from groundstation.data_sets.inputs import inputs_of
from groundstation.data_sets.star_folder import find_frames, read_frame
from groundstation.files.errors import FileError
from groundstation.files.number_tables import csv_text
from groundstation.files.writing import check_targets, write_file
from groundstation.overhead.circle_tracker import NoOverheadFix, OverheadFix, OverheadTracker
from groundstation.overhead.liveries import load_liveries
from groundstation.overhead.overhead_camera import OverheadCamera

COLUMNS = (
    "frame",
    "vehicle",
    "fix",
    "x_m",
    "y_m",
    "heading_rad",
    "ms",
    "circles",
    "std_x_m",
    "std_y_m",
    "std_heading_rad",
    "misfit_m",
    "reason",
)


def overhead(
    folder: Annotated[Path, typer.Argument(help="With camera.json, mock_ups.toml and frames/ in colour.")],
    out: Annotated[Path, typer.Option(help="CSV to write, one row per frame and mock-up.")],
) -> None:
    """Find mock-ups in pictures taken from above.

    Each picture is looked at on its own.
    mock_ups.toml states which coloured circles each mock-up wears, camera.json is that of the camera over the
    table; ms is the CPU time of the whole picture.

    Example: groundstation star-tracker overhead try/from_above --out answers.csv
    """
    cv2.setNumThreads(1)
    check_targets(out, sources=inputs_of(folder))
    if not folder.is_dir():
        raise FileError(f"{folder}: no such folder.")
    camera = OverheadCamera.load(folder / "camera.json")
    tracker = OverheadTracker(camera, load_liveries(folder / "mock_ups.toml"))
    rows = []
    for path in with_progress(find_frames(folder), "looking"):
        image = read_frame(path, camera, is_colour=True)
        begin = time.process_time()
        answers = tracker.look(image)
        ms = 1000.0 * (time.process_time() - begin)
        rows += [_row(path.stem, answer, ms) for answer in answers]
    write_file(out, csv_text(COLUMNS, rows))


def _row(frame: str, answer: OverheadFix | NoOverheadFix, ms: float) -> list[str]:
    if isinstance(answer, NoOverheadFix):
        return [frame, answer.vehicle, "0", "", "", "", f"{ms:.3f}", "0", "", "", "", "", answer.reason]
    pose = (answer.x_m, answer.y_m, answer.heading_rad)
    sigma = np.sqrt(np.diag(answer.covariance)).tolist()
    return [
        frame,
        answer.vehicle,
        "1",
        *(f"{value:.7f}" for value in pose),
        f"{ms:.3f}",
        str(answer.circles),
        *(f"{value:.3e}" for value in (*sigma, answer.misfit_m)),
        "",
    ]
