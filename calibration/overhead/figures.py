"""Figure of the overhead camera's pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from calibration.sky.figures import draw_cloud, draw_distribution
from groundstation.files.png import new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


def draw_board_pose(residual_px: Array, tape_m: Array, tape_rad: Array) -> Figure:
    """What a board on the table leaves of the camera above it: its corners, and each place against the tape.

    Args:
        residual_px: Corner minus model, shape (n, 2).
        tape_m: By how much each place had to be moved, shape (k, 2).
        tape_rad: And turned, shape (k,).
    """
    figure = new_figure(15.0, 4.5)
    corners, spread, tape = figure.subplots(1, 3)
    draw_cloud(corners, residual_px, "corners of the board")
    draw_distribution(spread, residual_px)
    tape.plot(1e3 * tape_m[:, 0], 1e3 * tape_m[:, 1], "o")
    for number, (place_m, turn_rad) in enumerate(zip(tape_m, tape_rad, strict=True), start=1):
        words = f"{number}: {np.degrees(turn_rad):+.2f} deg"
        tape.annotate(words, 1e3 * place_m, (0, 6), textcoords="offset points", ha="center")
    tape.axhline(0.0, color="0.8", zorder=0)
    tape.axvline(0.0, color="0.8", zorder=0)
    tape.margins(0.35)
    tape.set(xlabel="moved in x (mm)", ylabel="moved in y (mm)", title="places against the tape")
    return figure
