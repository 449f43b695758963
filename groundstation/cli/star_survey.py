"""``groundstation star-tracker survey``: the star list from a slow sweep under the ceiling."""

from pathlib import Path
from typing import Annotated

import cv2
import typer

from calibration.sky.survey.sweep import survey_sweep
from calibration.sky.survey.verification import Verification
from groundstation.cli.errors import UsageError
from groundstation.cli.star_files import (
    check_targets,
    find_frames,
    read_anchors,
    read_frame,
    with_progress,
    write_atomically,
)
from groundstation.cli.star_outcome import progress_line, refusing, write_outcome
from groundstation.files.errors import FileError
from groundstation.star_tracking.camera_model import CameraCalibration
from groundstation.star_tracking.detection import detect


def survey(
    folder: Annotated[
        Path, typer.Argument(help="With camera.json, anchors.csv and frames/ of a slow sweep.")
    ],
    out: Annotated[Path, typer.Option(help="Catalogue to write (CSV); its provenance beside it (TOML).")],
    tape_std_mm: Annotated[float, typer.Option(help="How well the anchors were measured.", min=0.01)] = 3.0,
    camera_out: Annotated[
        Path | None, typer.Option(help="camera.json to write with the ceiling's height as found.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Map and residual plot to write (PNG).")] = None,
    verify_every: Annotated[
        int, typer.Option(help="First without every so many pictures, to verify; 0: never.", min=0)
    ] = 6,
    lens: Annotated[
        bool, typer.Option("--lens", help="Calibrate the lens from the same sweep (write --camera-out).")
    ] = False,
) -> None:
    """Make the star catalogue from a sweep.

    The sweep's frames overlap. Two anchors or more (anchors.csv: id,x_m,y_m,frame,u,v)
    fix the frame of the table.

    Example:
      groundstation star-tracker survey recordings/sweep --out ceiling.csv --plot ceiling.png
    """
    cv2.setNumThreads(1)
    beside = out.with_suffix(".toml")
    check_targets(out, beside, camera_out, plot)
    if out == beside:
        raise UsageError(f"{out}: is the name of the provenance; call the catalogue {out.stem}.csv.")
    try:
        camera = CameraCalibration.load(folder / "camera.json")
    except FileError as error:
        raise UsageError(str(error)) from error
    frames = find_frames(folder)
    names = [path.stem for path in frames]
    anchors = read_anchors(folder / "anchors.csv", names)
    pictures = [detect(read_frame(path, camera)) for path in with_progress(frames, "finding stars")]
    with refusing(folder), progress_line() as progress:
        found = survey_sweep(
            pictures,
            anchors,
            camera,
            names,
            tape_std_m=1e-3 * tape_std_mm,
            is_lens_free=lens,
            verify_every=verify_every,
            progress=progress,
        )
    write_atomically(out, found.catalogue_csv())
    if found.verification is not None:
        print(_verified(found.verification))
    files = [folder / "camera.json", folder / "anchors.csv", *frames]
    write_outcome(folder, found.outcome, files, beside, camera_out, plot)


def _verified(found: Verification) -> str:
    if not found.solved:
        return f"verification: none of {found.pictures} pictures held out could be solved."
    words = (
        f"verification: {found.solved} of {found.pictures} pictures held out solved, "
        f"{1e3 * found.rms_m:.3f} mm per axis between star and spot "
        f"({100.0 * found.matched_ratio:.1f} % of {found.spots} spots matched, "
        f"{100.0 * found.clipped_ratio:.1f} % near a star but clipped)"
    )
    if found.worst_star:
        words += (
            f", {1e3 * found.star_std_m:.3f} mm of the stars themselves, "
            f"star {found.worst_star} farthest off by {1e3 * found.worst_m:.2f} mm"
        )
    return words + "."
