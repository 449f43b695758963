"""``groundstation star-tracker``: star fixes from frames in a folder."""

import gc
import math
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from numpy.typing import NDArray

from groundstation.cli.overhead import overhead
from groundstation.cli.plot_option import Plot
from groundstation.cli.progress import with_progress
from groundstation.cli.star_options import SkyOptions
from groundstation.cli.star_pictures import PictureFolder
from groundstation.data_sets.inputs import FRAMES, inputs_of
from groundstation.data_sets.star_folder import DamagedPicture, find_frames, load_sky, read_frame
from groundstation.declarations.errors import UsageError
from groundstation.files.number_tables import csv_text
from groundstation.files.png import png_of
from groundstation.files.writing import Content, check_folder, check_targets, whole_folder, write_files
from groundstation.star_tracking.answer_figure import Answers, draw_answers
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.fixes import NoFix, PictureFix, Refusal
from groundstation.star_tracking.identifications import IDENTIFICATIONS, IMAGES
from groundstation.star_tracking.published_settings import LEVEL_RATIO
from groundstation.star_tracking.star_catalogue import StarCatalogue

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
_METHODS = ", ".join(IDENTIFICATIONS)


@app.callback()
def _root() -> None:
    """Star fixes from pictures of a ceiling of LEDs, and mock-ups from above.

    The sky is calibrated by `groundstation calibrate`: survey, lens, board, mount, delay, amend.
    """


def solve(
    folder: Annotated[Path, typer.Argument(help="With ceiling.csv, camera.json and frames/.")],
    out: Annotated[Path, typer.Option(help="CSV to write, one row per frame.")],
    method: Annotated[
        str, typer.Option(help=f"Picture steps and identification, one of: {_METHODS}.")
    ] = "default",
    image: Annotated[
        str | None, typer.Option(help=f"Picture steps other than the method's, one of: {', '.join(IMAGES)}.")
    ] = None,
    identification: Annotated[
        str | None, typer.Option(help=f"Identification other than the method's, one of: {_METHODS}.")
    ] = None,
    level: Annotated[
        float | None,
        typer.Option(
            help="Published picture steps: intensity below which a pixel is zero, 0 darkest to 1 brightest "
            f"of the picture; not published, {LEVEL_RATIO:g} assumed."
        ),
    ] = None,
    angle_limit_deg: Annotated[
        float | None,
        typer.Option(
            help="Published identification: how far two angles may differ; not published, 1.2 assumed."
        ),
    ] = None,
    closeness_mm: Annotated[
        float | None,
        typer.Option(help="Published identification: how close places must be; not published, 50 assumed."),
    ] = None,
    tree: Annotated[bool, typer.Option("--tree", help="Our addition: a k-d tree of angles.")] = False,
    drop_thin: Annotated[
        bool,
        typer.Option("--drop-thin", help="Our addition: no triangles with angles above 150 deg."),
    ] = False,
    only_similar: Annotated[
        bool,
        typer.Option("--only-similar", help="Our addition: only maps that are nearly similarities."),
    ] = False,
    median: Annotated[
        bool,
        typer.Option("--median", help="Our addition: the median in the place of the mean."),
    ] = False,
    pictures: Annotated[
        Path | None, typer.Option(help="Folder for the refused frames, lights ringed and stars named (PNG).")
    ] = None,
    every_picture: Annotated[
        bool, typer.Option("--every-picture", help="With --pictures: all frames, not only refused ones.")
    ] = False,
    plot: Plot = None,
) -> None:
    """Solve every frame of a folder on its own, lost in space.

    The published methods are as published: the picture normalised by its least and largest intensity, all
    Delaunay triangles, the mean of the longest run of places close to each other. Their options are what the
    publication does not state, or what we added.

    Example: groundstation star-tracker solve try/ceiling --out answers.csv

    Example: groundstation star-tracker solve try/ceiling --out answers.csv --method published --image default
    """
    cv2.setNumThreads(1)
    check_targets(out, plot, sources=inputs_of(folder))
    if pictures is not None:
        check_folder(pictures, sources=[folder / FRAMES])
    added = {"uses_tree": tree, "drops_thin": drop_thin, "only_similar": only_similar, "takes_median": median}
    options = SkyOptions(method, image, identification, level, angle_limit_deg, closeness_mm, added)
    options.check()
    camera, catalogue = load_sky(folder)
    frames = find_frames(folder)
    if every_picture and pictures is None:
        raise UsageError("--every-picture needs --pictures, the folder for them.")
    solver = _solver(options, camera, catalogue)
    with suppress(DamagedPicture):
        solver(read_frame(frames[0], camera))  # the first call pays for memory and lazy imports
    answers = Answers([], [], [])
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
                picture = read_frame(path, camera)
            except DamagedPicture:
                answers.add(path.stem, NoFix(Refusal.DAMAGED, "", 0), 0.0)
                continue
            begin = time.process_time()
            answer = solver(picture)
            answers.add(path.stem, answer, 1000.0 * (time.process_time() - begin))
            if drawn is not None:
                drawn.note(path.stem, picture, answer)
        contents: dict[Path, Content] = {out: csv_text(COLUMNS, [_row(*each) for each in answers.rows()])}
        if plot is not None:
            contents[plot] = png_of(draw_answers(answers, catalogue))
        write_files(contents)


def _solver(
    options: SkyOptions, camera: CameraCalibration, catalogue: StarCatalogue
) -> Callable[[NDArray[np.uint8]], PictureFix | NoFix]:
    find = IMAGES[options.image_row](options.settings)
    solver = IDENTIFICATIONS[options.identification_row](catalogue, camera, options.settings)
    return lambda picture: solver.solve(find(picture))


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
