"""`groundstation calibrate` for the star camera: lens, mount, delay, survey, amend."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import cv2
import typer

from calibration.delivery import deliver, refusing
from calibration.result import provenance_of
from calibration.sky.amend import amended_list
from calibration.sky.delay import delay_from_headings
from calibration.sky.lens import lens_from_board, lens_from_stars, mount_from_turn
from calibration.sky.pictures import find_spots, printed_board, read_sky_pictures, same_size
from calibration.sky.survey.anchors import read_anchors
from calibration.sky.survey.sweep import survey_sweep
from calibration.sky.turns import read_turns
from groundstation.cli.plot_option import Plot
from groundstation.cli.progress import progress_line
from groundstation.data_sets.inputs import FRAMES, inputs_of
from groundstation.data_sets.star_folder import find_frames
from groundstation.declarations.errors import UsageError
from groundstation.files.writing import check_targets
from groundstation.star_tracking.camera_model import CameraCalibration

Folder = Annotated[Path, typer.Argument(help="With camera.json, ceiling.csv and frames/.")]
Out = Annotated[Path, typer.Option(help="Result with provenance to write (TOML).")]
CameraOut = Annotated[Path | None, typer.Option(help="camera.json to write with the new values.")]


def lens(
    folder: Folder,
    out: Out,
    camera_out: CameraOut = None,
    plot: Plot = None,
    wobble_mm: Annotated[
        float | None,
        typer.Option(
            help="The frames were made turning in place; the origin moved so far.", min=1e-3, max=1e3
        ),
    ] = None,
) -> None:
    """Calibrate the lens from the star field itself.

    Frames made by turning in place (--wobble-mm) also separate the principal point from the mount.

    Example: groundstation calibrate lens try/turn --out lens.toml --camera-out camera.json
    """
    check_targets(out, camera_out, plot, sources=inputs_of(folder))
    sky = read_sky_pictures(folder)
    wobble_m = None if wobble_mm is None else 1e-3 * wobble_mm
    with refusing(folder), progress_line() as progress:
        found = lens_from_stars(sky.pictures, sky.catalogue, sky.camera, wobble_m=wobble_m, progress=progress)
    deliver(found, provenance_of(folder, files=sky.files), out, plot, camera_out)


def mount(
    folder: Folder,
    out: Out,
    camera_out: CameraOut = None,
    plot: Plot = None,
    wobble_mm: Annotated[float, typer.Option(help="How far the body origin moved.", min=1e-3, max=1e3)] = 1.0,
    first_heading_deg: Annotated[
        float | None,
        typer.Option(
            help="True heading of the first frame; it gives the mount's yaw.", min=-360.0, max=360.0
        ),
    ] = None,
) -> None:
    """Calibrate offset, tilt and yaw of the camera.

    The frames are made by turning the mock-up in place.

    Example: groundstation calibrate mount try/turn --out mount.toml --first-heading-deg 0
    """
    check_targets(out, camera_out, plot, sources=inputs_of(folder))
    sky = read_sky_pictures(folder)
    heading = None if first_heading_deg is None else math.radians(first_heading_deg)
    with refusing(folder), progress_line() as progress:
        found = mount_from_turn(
            sky.pictures,
            sky.catalogue,
            sky.camera,
            wobble_m=1e-3 * wobble_mm,
            first_heading_rad=heading,
            progress=progress,
        )
    deliver(found, provenance_of(folder, files=sky.files), out, plot, camera_out)


def board(
    folder: Annotated[Path, typer.Argument(help="With frames/ of a chessboard or ChArUco board.")],
    out: Out,
    squares: Annotated[str, typer.Option(help="Squares of the board, as 9x6.")] = "9x6",
    square_mm: Annotated[float, typer.Option(help="Edge of a square.", min=0.1, max=1e4)] = 30.0,
    marker_mm: Annotated[
        float, typer.Option(help="Edge of a ChArUco marker; 0: plain.", min=0.0, max=1e4)
    ] = 0.0,
    camera: Annotated[Path | None, typer.Option(help="camera.json whose other keys to keep.")] = None,
    camera_out: CameraOut = None,
    plot: Plot = None,
) -> None:
    """Calibrate the lens by pictures of a board.

    A chessboard or a ChArUco board, seen at many angles all over the picture.

    Example: groundstation calibrate board try/board --squares 9x6 --square-mm 30 --out lens.toml
    """
    cv2.setNumThreads(1)
    check_targets(out, camera_out, plot, sources=[folder / FRAMES, camera])
    if camera_out is not None and camera is None:
        raise UsageError("--camera-out needs --camera, which gives the mount and the height.")
    printed = printed_board(squares, square_mm, marker_mm, "9x6")
    kept = None if camera is None else CameraCalibration.load(camera)
    frames = find_frames(folder)
    with refusing(folder), progress_line() as progress:
        found = lens_from_board(same_size(frames), printed, camera=kept, progress=progress)
    deliver(found, provenance_of(folder, files=frames), out, plot, camera_out)


def delay(
    source: Annotated[Path, typer.Argument(help="Recording (.mcap), or folder with imu.csv and stars.csv.")],
    out: Out,
    guess_s: Annotated[
        float | None,
        typer.Option(help="First guess of the delay; default: the rig's, or 0.05.", min=0.0, max=10.0),
    ] = None,
    vehicle: Annotated[str | None, typer.Option(help="Whose, if the recording holds several.")] = None,
    plot: Plot = None,
) -> None:
    """Calibrate the camera's delay against the IMU.

    Star headings are laid on the integrated turn rate.
    The mock-up must turn to and fro. imu.csv needs t_s,omega_rad_s; stars.csv t_arrival_s,heading_rad.
    The rig reads the result: delay_file = "delay.toml" in its star_camera section.

    Example: groundstation calibrate delay recordings/wiggle.mcap --out delay.toml
    """
    check_targets(out, plot, sources=inputs_of(source))
    turns = read_turns(source, vehicle)
    with refusing(source, turns.notes), progress_line() as progress:
        found = delay_from_headings(
            turns.gyro_t_s,
            turns.rate_rad_s,
            turns.arrival_t_s,
            turns.heading_rad,
            guess_s=turns.guess_s if guess_s is None else guess_s,
            progress=progress,
        )
    deliver(found, provenance_of(source, files=turns.files), out, plot, aside=turns.notes)


def survey(
    folder: Annotated[
        Path, typer.Argument(help="With camera.json, anchors.csv and frames/ of a slow sweep.")
    ],
    out: Annotated[Path, typer.Option(help="Catalogue to write (CSV); its provenance beside it (TOML).")],
    tape_sigma_mm: Annotated[
        float, typer.Option("--tape-std-mm", help="How well the anchors were measured.", min=0.01, max=1e3)
    ] = 3.0,
    camera_out: Annotated[
        Path | None, typer.Option(help="camera.json to write with the ceiling's height as found.")
    ] = None,
    plot: Plot = None,
    verify_every: Annotated[
        int,
        typer.Option(help="First without every so many pictures, to verify; 0: never.", min=0, max=10_000),
    ] = 6,
    lens: Annotated[
        bool, typer.Option("--lens", help="Calibrate the lens from the same sweep (write --camera-out).")
    ] = False,
) -> None:
    """Make the star catalogue from a sweep.

    The sweep's frames overlap. Two anchors or more (anchors.csv: id,x_m,y_m,frame,u,v)
    fix the frame of the table.

    Example: groundstation calibrate survey try/sweep --out ceiling.csv --plot ceiling.png
    """
    beside = out.with_suffix(".toml")
    if out == beside:
        raise UsageError(f"{out}: is the name of the provenance; call the catalogue {out.stem}.csv.")
    read = [folder / name for name in ("camera.json", "anchors.csv", FRAMES)]
    check_targets(out, beside, camera_out, plot, sources=read)
    camera = CameraCalibration.load(folder / "camera.json")
    frames = find_frames(folder)
    names = [path.stem for path in frames]
    anchors = read_anchors(folder / "anchors.csv", names)
    pictures = find_spots(frames, camera)
    with refusing(folder), progress_line() as progress:
        found = survey_sweep(
            pictures,
            anchors,
            camera,
            names,
            tape_sigma_m=1e-3 * tape_sigma_mm,
            is_lens_free=lens,
            verify_every=verify_every,
            progress=progress,
        )
    files = [folder / "camera.json", folder / "anchors.csv", *frames]
    catalogue = {out: found.catalogue_csv()}
    deliver(found.outcome, provenance_of(folder, files=files), beside, plot, camera_out, also=catalogue)


def amend(
    ceiling: Annotated[Path, typer.Argument(help="Star list that the recording was made with (CSV).")],
    recording: Annotated[Path, typer.Argument(help="Recording (.mcap).")],
    out: Annotated[Path, typer.Option(help="Star list to write (CSV); its provenance beside it (TOML).")],
    min_sightings: Annotated[
        int, typer.Option(help="Add lights that were seen so often at one place.", min=1, max=1_000_000)
    ] = 50,
) -> None:
    """Bring a star list up to date from a flight.

    Dead stars are struck off, moved ones put to their new places, new lights added.
    What the watchdog of the sky found while flying is applied; the last word on each star counts.

    Example: groundstation calibrate amend ceiling.csv run.mcap --out ceiling_new.csv
    """
    beside = out.with_suffix(".toml")
    check_targets(out, beside, sources=inputs_of(ceiling, recording))
    with refusing(ceiling):
        text, found = amended_list(ceiling, recording, min_sightings)
    deliver(found, provenance_of(recording), beside, also={out: text})
