"""``groundstation recording film``: a run as a film."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.cli.number_options import FromS, ToS
from groundstation.cli.run_progress import RunProgress
from groundstation.data_sets.inputs import inputs_of
from groundstation.declarations.errors import UsageError
from groundstation.files.writing import check_targets
from groundstation.recording.errors import RecordingError
from groundstation.watch.film import FilmPlan, write_film


def film(
    file: Annotated[Path, typer.Argument(help="Recording (.mcap), or the folder of a run.")],
    out: Annotated[Path, typer.Option(help="Film to write (.mp4, .avi).")],
    from_s: FromS = 0.0,
    to_s: ToS = None,
    speed: Annotated[
        float, typer.Option(help="Seconds of flight in a second of film.", min=0.01, max=1000.0)
    ] = 1.0,
    fps: Annotated[float, typer.Option(help="Pictures in a second of film.", min=1.0, max=120.0)] = 25.0,
    height: Annotated[int, typer.Option(help="Of a drawn picture, pixels.", min=240, max=2160)] = 720,
    camera: Annotated[
        bool,
        typer.Option("--camera", help="Pictures of the camera over the table, where they were recorded."),
    ] = False,
) -> None:
    """Film the table from above: mock-ups to scale, headings, trails, goals, firing thrusters, what happened.

    Places are by truth where there is any, else by the estimate.

    Example: groundstation recording film run.mcap --out try/run.mp4

    Example: groundstation recording film run.mcap --from-s 20 --to-s 60 --speed 4 --out try/fast.mp4
    """
    check_targets(out, sources=inputs_of(file))
    try:
        with RunProgress(1.0) as progress:
            plan = FilmPlan(from_s, to_s, speed, fps, height, camera)
            count, codec = write_film(file, out, plan, progress)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    print(f"{out}: {count / fps:.1f} s, {count} pictures, {codec}")
