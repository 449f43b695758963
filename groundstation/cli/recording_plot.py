"""``groundstation recording plot``: any field of any topic against time."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.cli.number_options import FromS, ToS
from groundstation.data_sets.inputs import inputs_of
from groundstation.declarations.errors import UsageError
from groundstation.files.png import write_png
from groundstation.files.writing import check_targets
from groundstation.recording.errors import RecordingError
from groundstation.recording.opened import OpenedRecording
from groundstation.watch.field_plot import curves_of, draw_curves


def plot(
    file: Annotated[Path, typer.Argument(help="Recording (.mcap), or the folder of a run.")],
    field: Annotated[
        list[str], typer.Argument(help="Field, e.g. 'alpha/state.position_table_m[0]'; several.")
    ],
    out: Annotated[Path, typer.Option(help="PNG to write.")],
    from_s: FromS = 0.0,
    to_s: ToS = None,
) -> None:
    """Draw fields of a recording against time, those of one unit on one axis.

    A vector without a place in brackets is drawn whole. `groundstation recording info` lists the topics; a
    field that is not there is refused with the names of those that are.

    Example: groundstation recording plot run.mcap alpha/state.heading_rad alpha/wrench.force_x_n --out x.png

    Example: groundstation recording plot run.mcap 'alpha/state.position_table_m[0]' --to-s 25 --out x.png
    """
    if out.suffix.lower() != ".png":  # never a picture in the place of a recording
        raise UsageError(f"{out} must end in .png: that is what is written")
    check_targets(out, sources=inputs_of(file))
    try:
        with OpenedRecording(file) as recording:
            curves = curves_of(recording, field, (from_s, to_s))
            title = f"{file.name}, {recording.duration_s:.1f} s"
    except RecordingError as error:
        raise UsageError(str(error)) from error
    write_png(out, draw_curves(curves, title))
    print(f"{out}: {', '.join(f'{curve.name} ({len(curve.t_s)} points)' for curve in curves)}")
