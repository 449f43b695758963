"""``groundstation recording cut``: a stretch of a recording as a recording of its own."""

from pathlib import Path
from typing import Annotated

import typer

from groundstation.cli.number_options import FromS, ToS
from groundstation.cli.run_progress import RunProgress
from groundstation.declarations.errors import UsageError
from groundstation.parts.table import installed_tables
from groundstation.recording.cut import cut as cut_file
from groundstation.recording.errors import RecordingError


def cut(
    file: Annotated[Path, typer.Argument(help="Recording (.mcap), or the folder of a run.")],
    out: Annotated[Path, typer.Option(help="Recording to write (.mcap).")],
    from_s: FromS = 0.0,
    to_s: ToS = None,
) -> None:
    """Write what was recorded between two moments into a recording of its own.

    Stamps, log times and numbers stay. What was latched before (calibrations, modes, faults, the lease)
    stands at its beginning. `groundstation replay` feeds nodes from their start on: it needs a cut from 0 s.

    Example: groundstation recording cut run.mcap --from-s 20 --to-s 35 --out landing.mcap
    """
    latched = [kind for kind in installed_tables().payloads.values() if kind.TOPIC.latched]
    try:
        with RunProgress(1.0) as progress:
            count = cut_file(file, out, (from_s, to_s), latched, progress)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    print(f"{out}: {count} messages")
