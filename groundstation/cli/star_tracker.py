"""``groundstation star-tracker``: star fixes from frames in a folder, and the sky's calibrations."""

import csv
import gc
import io
import json
import math
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from calibration.camera import CalibrationFileError, CameraCalibration, StarCatalogue
from groundstation.cli import star_amend, star_calibration
from groundstation.cli.errors import UsageError
from groundstation.cli.star_files import (
    check_targets,
    find_frames,
    read_anchors,
    read_frame,
    whole_folder,
    with_progress,
    write_atomically,
)
from groundstation.cli.star_pictures import PictureFolder
from groundstation.cli.star_plots import plot_residuals
from groundstation.star_tracking.detection import Detector, Spots, detect
from groundstation.star_tracking.fixes import NoFix, StarFix
from groundstation.star_tracking.published import PublishedTracker
from groundstation.star_tracking.sky_adjustment import HEIGHT
from groundstation.star_tracking.survey import LENS, Anchor, SurveyedSky, SurveyError
from groundstation.star_tracking.survey import survey as survey_sky
from groundstation.star_tracking.tracker import StarTracker

app = typer.Typer(
    no_args_is_help=True, rich_markup_mode=None, help="Star fixes from pictures of a ceiling of LEDs."
)

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


app.command()(star_calibration.intrinsics)
app.command()(star_calibration.board)
app.command()(star_calibration.mount)
app.command()(star_calibration.delay)
app.command()(star_amend.amend)


class Method(StrEnum):
    """Which star identification."""

    DEFAULT = "default"
    PUBLISHED = "published"


@app.callback()
def _root() -> None:
    """Star fixes from pictures of a ceiling of LEDs, and the calibrations of that sky."""


@app.command()
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

    Example:
      groundstation star-tracker solve recordings/ceiling --out answers.csv
    """
    cv2.setNumThreads(1)
    check_targets(out)
    camera, catalogue = load_sky(folder)
    frames = find_frames(folder)
    if every_picture and pictures is None:
        raise UsageError("--every-picture needs --pictures, the folder for them.")
    solver = _solver(method, camera, catalogue)
    solver(read_frame(frames[0], camera))  # the first call pays for memory and lazy imports
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    with ExitStack() as stack:
        gc.freeze()  # else the collector now and then looks at every loaded module: 20 ms in a frame's time
        stack.callback(gc.unfreeze)
        drawn = None
        if pictures is not None:
            drawn = PictureFolder(
                stack.enter_context(whole_folder(pictures)), camera, catalogue, every_picture
            )
        for path in with_progress(frames, "solving"):
            image = read_frame(path, camera)
            begin = time.process_time()
            answer = solver(image)
            writer.writerow(_row(path.stem, answer, 1000.0 * (time.process_time() - begin)))
            if drawn is not None:
                drawn.note(path.stem, image, answer)
        write_atomically(out, buffer.getvalue())


@app.command()
def survey(
    folder: Annotated[
        Path, typer.Argument(help="With camera.json, anchors.csv and frames/ of a slow sweep.")
    ],
    out: Annotated[Path, typer.Option(help="Catalogue to write (CSV).")],
    tape_std_mm: Annotated[float, typer.Option(help="How well the anchors were measured.", min=0.01)] = 3.0,
    camera_out: Annotated[
        Path | None, typer.Option(help="camera.json to write with the ceiling's height as found.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Residual plot to write (PNG).")] = None,
    verify_every: Annotated[
        int, typer.Option(help="First without every so many pictures, to verify; 0: never.", min=0)
    ] = 6,
    lens: Annotated[
        bool, typer.Option("--lens", help="Calibrate the lens from the same sweep (write --camera-out).")
    ] = False,
) -> None:
    """Make the star catalogue from the overlapping frames of a sweep.

    Two anchors or more (anchors.csv: id,x_m,y_m,frame,u,v) fix the frame of the table.

    Example:
      groundstation star-tracker survey recordings/sweep --out ceiling.csv
    """
    cv2.setNumThreads(1)
    check_targets(out, camera_out, plot)
    try:
        camera = CameraCalibration.load(folder / "camera.json")
    except CalibrationFileError as error:
        raise UsageError(str(error)) from error
    frames = find_frames(folder)
    free = LENS if lens else HEIGHT
    tape_std_m = 1e-3 * tape_std_mm
    anchors = read_anchors(folder / "anchors.csv", [path.stem for path in frames])
    pictures = [detect(read_frame(path, camera)) for path in with_progress(frames, "finding stars")]
    try:
        if verify_every > 1:
            kept_anyway = {anchor.frame for anchor in anchors}
            held = {i for i in range(verify_every - 1, len(frames), verify_every) if i not in kept_anyway}
            empty = detect(np.zeros((32, 32), np.uint8))
            blind = [empty if i in held else spots for i, spots in enumerate(pictures)]
            _verify(survey_sky(blind, anchors, camera, tape_std_m=tape_std_m, free=free), pictures, held)
        sky = survey_sky(pictures, anchors, camera, tape_std_m=tape_std_m, free=free)
    except SurveyError as error:
        raise UsageError(f"{folder}: {error}.") from error
    _warn_of_parts(folder, sky, anchors, [path.stem for path in frames])
    lines = ["id,x_m,y_m,std_x_m,std_y_m,times_seen"]
    for name, at, std, seen in zip(sky.ids, sky.star_m, sky.std_m, sky.times_seen, strict=True):
        lines.append(f"{name},{at[0]:.6f},{at[1]:.6f},{std[0]:.2e},{std[1]:.2e},{seen}")
    write_atomically(out, "\n".join(lines) + "\n")
    if camera_out is not None:
        write_atomically(camera_out, json.dumps(sky.camera.to_mapping(), indent=1) + "\n")
    if plot is not None:
        residual = sky.adjusted.residual_px[sky.adjusted.used]
        plot_residuals(plot, residual, f"Survey of {len(sky.ids)} stars from {len(sky.placed)} pictures")
    tape_mm = 1e3 * float(np.sqrt((sky.tape_residual_m**2).sum(axis=1).mean()))
    print(
        f"{len(sky.ids)} stars from {len(sky.placed)} of {len(frames)} pictures, "
        f"residual {sky.adjusted.rms_px:.3f} px, shape {1e3 * np.median(sky.std_m):.3f} mm (median sigma), "
        f"tape against pictures {tape_mm:.2f} mm, "
        f"ceiling {sky.camera.ceiling_height_above_camera_m:.4f} m above the camera."
    )


def _warn_of_parts(folder: Path, sky: SurveyedSky, anchors: Sequence[Anchor], frames: Sequence[str]) -> None:
    """Say which pictures and anchors hang on no picture of the surveyed part."""
    left_out = sorted(set(range(len(frames))) - set(sky.placed.tolist()))
    if len(sky.part_sizes) > 1:
        names = ", ".join(frames[i] for i in left_out[:8]) + (", ..." if len(left_out) > 8 else "")
        sys.stderr.write(
            f"{folder}: the sweep has gaps; {len(left_out)} pictures do not overlap the surveyed part "
            f"and were left out ({names}).\n"
        )
    for anchor in anchors:
        if anchor.name not in sky.anchors:
            sys.stderr.write(f"{folder}: anchor '{anchor.name}' lies outside the surveyed part, unused.\n")


def _verify(sky: SurveyedSky, pictures: Sequence[Spots], held: set[int]) -> None:
    """Solve the pictures that were held out with the catalogue made without them; print how they fit."""
    catalogue = StarCatalogue(
        sky.ids,
        sky.star_m[:, 0].copy(),
        sky.star_m[:, 1].copy(),
        np.sqrt((sky.std_m**2).mean(axis=1)),
    )
    tracker = StarTracker(catalogue, sky.camera)
    answers = [tracker.solve(pictures[i]) for i in sorted(held)]
    fixes = [answer for answer in answers if isinstance(answer, StarFix)]
    if not fixes:
        print(f"verification: none of {len(held)} pictures held out could be solved.")
        return
    residual = np.concatenate([fix.residual_m for fix in fixes])
    rms_mm = 1e3 * float(np.sqrt((residual**2).mean()))
    print(
        f"verification: {len(fixes)} of {len(held)} pictures held out solved, "
        f"{rms_mm:.3f} mm per axis between star and spot."
    )


def load_sky(folder: Path) -> tuple[CameraCalibration, StarCatalogue]:
    """Read camera.json and ceiling.csv of a folder.

    Raises:
        UsageError: One of them is missing or wrong.
    """
    if not folder.is_dir():
        raise UsageError(f"{folder}: no such folder.")
    try:
        return CameraCalibration.load(folder / "camera.json"), StarCatalogue.load(folder / "ceiling.csv")
    except CalibrationFileError as error:
        raise UsageError(str(error)) from error


def _solver(
    method: Method, camera: CameraCalibration, catalogue: StarCatalogue
) -> Callable[[NDArray[np.uint8]], StarFix | NoFix]:
    if method is Method.PUBLISHED:
        published = PublishedTracker(catalogue, camera)
        return lambda image: published.solve(detect(image))
    tracker, detector = StarTracker(catalogue, camera), Detector()
    return lambda image: tracker.solve(detector.find(image))


def _row(frame: str, answer: StarFix | NoFix, ms: float) -> list[str]:
    if isinstance(answer, NoFix):
        return [frame, "0", "", "", "", f"{ms:.3f}", "0", "", "", "", answer.reason.value]
    pose = (answer.x_m, answer.y_m, answer.heading_rad)
    spread = (answer.std_x_m, answer.std_y_m, answer.std_heading_rad)
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
