"""The anchors of a survey: stars measured by tape, and where each was clicked in one picture."""

from collections.abc import Sequence
from pathlib import Path

from calibration.sky.survey.surveyed_sky import Anchor
from groundstation.files.errors import FileError
from groundstation.files.number_tables import load_table
from groundstation.star_tracking.star_catalogue import FARTHEST_M

LEAST = 2
_MOST_PX = 1e5


def read_anchors(path: Path, frames: Sequence[str]) -> list[Anchor]:
    """Read anchors.csv: ``id,x_m,y_m,frame,u,v``; ``frames`` are the stems of the pictures in order.

    Raises:
        FileError: The file is missing, a column is, or a value is no number or no frame.
    """
    most = {"x_m": FARTHEST_M, "y_m": FARTHEST_M, "u": _MOST_PX, "v": _MOST_PX}
    table = load_table(path, tuple(most), ("id", "frame"), unique=("id",), most=most)
    number = {stem: i for i, stem in enumerate(frames)}
    anchors = []
    for line, name, frame, (x_m, y_m, u_px, v_px) in zip(
        table.lines, table.words["id"], table.words["frame"], table.numbers.tolist(), strict=True
    ):
        if frame not in number:
            raise FileError(f"{path}: line {line}, frame: there is no picture '{frame}'.")
        anchors.append(Anchor(name, x_m, y_m, number[frame], u_px, v_px))
    if len(anchors) < LEAST:
        raise FileError(f"{path}: holds {len(anchors)} anchors, a survey needs at least two.")
    return anchors
