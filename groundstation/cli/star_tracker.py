"""``groundstation star-tracker``: star fixes from frames in a folder."""

import gc
import math
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from groundstation.cli.overhead import overhead
from groundstation.cli.progress import with_progress
from groundstation.cli.star_pictures import PictureFolder
from groundstation.data_sets.star_folder import DamagedPicture, find_frames, load_sky, read_frame
from groundstation.declarations.errors import UsageError
from groundstation.files.number_tables import csv_text
from groundstation.files.writing import check_targets, whole_folder, write_file
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import Detector, detect
from groundstation.star_tracking.fixes import NoFix, PictureFix, Refusal
from groundstation.star_tracking.published import PublishedTracker
from groundstation.star_tracking.star_catalogue import StarCatalogue
from groundstation.star_tracking.tracker import StarTracker

app = typer.Typer(no_args_is_help=True, rich_markup_mode=None)

COLUMNS = (
    "frame",
    "fix",
    "x_m",
    "y_m",
    "heading_rad",
    "ms",
    "stars",
    "std_x_m",
    "std_y_m",
    "std_heading_rad",
    "reason",
)


class Method(StrEnum):
    """Which star identification."""

    DEFAULT = "default"
    PUBLISHED = "published"


@app.callback()
def _root() -> None:
    """Star fixes from pictures of a ceiling of LEDs, and mock-ups from above.

    The sky is calibrated by `groundstation calibrate`: survey, lens, board, mount, delay, amend.
    """


def solve(
    folder: Annotated[Path, typer.Argument(help="With ceiling.csv, camera.json and frames/.")],
    out: Annotated[Path, typer.Option(help="CSV to write, one row per frame.")],
    method: Annotated[Method, typer.Option(help="Star identification.")] = Method.DEFAULT,
    pictures: Annotated[
        Path | None, typer.Option(help="Folder for the refused frames, lights ringed and stars named (PNG).")
    ] = None,
    every_picture: Annotated[
        bool, typer.Option("--every-picture", help="With --pictures: all frames, not only refused ones.")
    ] = False,
) -> None:
    """Solve every frame of a folder on its own, lost in space.

    Example: groundstation star-tracker solve try/ceiling --out answers.csv
    """
    cv2.setNumThreads(1)
    check_targets(out)
    camera, catalogue = load_sky(folder)
    frames = find_frames(folder)
    if every_picture and pictures is None:
        raise UsageError("--every-picture needs --pictures, the folder for them.")
    solver = _solver(method, camera, catalogue)
    with suppress(DamagedPicture):
        solver(read_frame(frames[0], camera))  # the first call pays for memory and lazy imports
    rows = []
    with ExitStack() as stack:
        gc.freeze()  # else the collector now and then looks at every loaded module: 20 ms in a frame's time
        stack.callback(gc.unfreeze)
        drawn = None
        if pictures is not None:
            drawn = PictureFolder(
                stack.enter_context(whole_folder(pictures)), camera, catalogue, every_picture
            )
        for path in with_progress(frames, "solving"):
            try:
                image = read_frame(path, camera)
            except DamagedPicture:
                rows.append(_row(path.stem, NoFix(Refusal.DAMAGED, "", 0), 0.0))
                continue
            begin = time.process_time()
            answer = solver(image)
            rows.append(_row(path.stem, answer, 1000.0 * (time.process_time() - begin)))
            if drawn is not None:
                drawn.note(path.stem, image, answer)
        write_file(out, csv_text(COLUMNS, rows))


def _solver(
    method: Method, camera: CameraCalibration, catalogue: StarCatalogue
) -> Callable[[NDArray[np.uint8]], PictureFix | NoFix]:
    if method is Method.PUBLISHED:
        published = PublishedTracker(catalogue, camera)
        return lambda image: published.solve(detect(image))
    tracker, detector = StarTracker(catalogue, camera), Detector()
    return lambda image: tracker.solve(detector.find(image))


def _row(frame: str, answer: PictureFix | NoFix, ms: float) -> list[str]:
    if isinstance(answer, NoFix):
        return [frame, "0", "", "", "", f"{ms:.3f}", "0", "", "", "", answer.reason.value]
    pose = (answer.x_m, answer.y_m, answer.heading_rad)
    spread = (answer.sigma_x_m, answer.sigma_y_m, answer.sigma_heading_rad)
    if not all(math.isfinite(value) for value in (*pose, *spread)):
        raise AssertionError(f"frame {frame}: the solver gave a fix that is not finite")
    return [
        frame,
        "1",
        *(f"{value:.7f}" for value in pose),
        f"{ms:.3f}",
        str(answer.stars),
        *(f"{value:.3e}" for value in spread),
        "",
    ]


app.command()(solve)
app.command()(overhead)
