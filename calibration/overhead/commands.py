"""`groundstation calibrate overhead`: where the camera over the table hangs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from calibration.delivery import deliver, refusing
from calibration.overhead.board_views import read_board_views
from calibration.overhead.procedure import pose_by_board
from calibration.result import provenance_of
from calibration.sky.pictures import printed_board
from groundstation.cli.plot_option import Plot
from groundstation.data_sets.inputs import inputs_of
from groundstation.files.writing import check_targets


def overhead(
    folder: Annotated[Path, typer.Argument(help="With camera.json (its lens), places.csv and frames/.")],
    out: Annotated[Path, typer.Option(help="Result with provenance to write (TOML).")],
    camera_out: Annotated[Path | None, typer.Option(help="camera.json to write with the pose.")] = None,
    squares: Annotated[str, typer.Option(help="Squares of the ChArUco board, as 6x4.")] = "6x4",
    square_mm: Annotated[float, typer.Option(help="Edge of a square.", min=0.1, max=1e4)] = 150.0,
    marker_mm: Annotated[float, typer.Option(help="Edge of a marker.", min=0.1, max=1e4)] = 110.0,
    thickness_mm: Annotated[float, typer.Option(help="Of the board.", min=0.0, max=1e3)] = 0.0,
    plot: Plot = None,
    tape_mm: Annotated[float, typer.Option(help="How well places were measured.", min=0.01, max=1e3)] = 2.0,
    tape_deg: Annotated[float, typer.Option(help="How well headings were.", min=1e-3, max=90.0)] = 0.2,
) -> None:
    """Find where the camera over the table hangs.

    The pictures show a ChArUco board that lies on the table.
    places.csv has the columns frame,x_m,y_m,heading_deg: where the print's upper left corner lies in the
    table's coordinates, and where its long edge points. One place is enough; several check the tape.

    Example: groundstation calibrate overhead try/board_on_table --out pose.toml --camera-out camera.json
    """
    check_targets(out, camera_out, plot, sources=inputs_of(folder))
    printed = printed_board(squares, square_mm, marker_mm, "6x4")
    views, lens = read_board_views(folder, printed)
    with refusing(folder):
        found = pose_by_board(
            views, lens, 1e-3 * tape_mm, math.radians(tape_deg), thickness_m=1e-3 * thickness_mm
        )
    deliver(found, provenance_of(folder / "places.csv"), out, plot, camera_out)
