"""What the commands of the sky's calibrations share: progress, refusals, files of a result."""

import hashlib
import json
import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console

from calibration.result import Provenance
from calibration.sky.outcome import CalibrationRefusedError, Outcome, Progress, silent
from groundstation.cli.errors import UsageError
from groundstation.cli.star_files import write_atomically
from groundstation.cli.star_plots import save_figure


@contextmanager
def progress_line() -> Iterator[Progress]:
    """Show progress as one line on a terminal's stderr, nothing elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield silent
        return
    with console.status("") as status:

        def tell(what: str, share: float) -> None:
            status.update(what if math.isnan(share) else f"{what}: {100.0 * share:.0f} %")

        yield tell


@contextmanager
def refusing(folder: Path) -> Iterator[None]:
    """Turn a refused calibration into a usage error that names the folder."""
    try:
        yield
    except CalibrationRefusedError as error:
        raise UsageError(f"{folder}: {error}.") from error


def write_outcome(
    folder: Path,
    found: Outcome,
    files: Sequence[Path],
    out: Path,
    camera_out: Path | None,
    plot: Path | None,
) -> None:
    """Write a result with its provenance, the camera and the plot; print summary and warnings.

    Args:
        folder: The data.
        found: What was made of them.
        files: What was read, for the hash.
        out: TOML to write.
        camera_out: camera.json to write, if wanted.
        plot: PNG to write, if wanted.

    Raises:
        UsageError: A file cannot be written.
    """
    write_atomically(out, found.to_toml(_provenance(folder, files)))
    if camera_out is not None and found.camera is not None:
        write_atomically(camera_out, json.dumps(found.camera.to_mapping(), indent=1) + "\n")
    if plot is not None:
        save_figure(found.draw(), plot)
    for warning in found.warnings:
        sys.stderr.write(f"{folder}: {warning}.\n")
    print(found.summary)


def _provenance(folder: Path, files: Sequence[Path]) -> Provenance:
    digest = hashlib.sha256()
    for path in files:
        digest.update(path.name.encode())
        digest.update(path.read_bytes())
    return Provenance(folder.resolve().name, digest.hexdigest(), datetime.now(UTC))
