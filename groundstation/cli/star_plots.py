"""Figures to files."""

import os
import tempfile
from pathlib import Path

from matplotlib.figure import Figure

from groundstation.cli.errors import UsageError


def save_figure(figure: Figure, path: Path) -> None:
    """Write a PNG whole or not at all.

    Raises:
        UsageError: The file cannot be written.
    """
    try:
        handle, temporary = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.", suffix=".part")
        with os.fdopen(handle, "wb") as file:
            figure.savefig(file, format="png", dpi=110)
        Path(temporary).chmod(0o644)
        Path(temporary).replace(path)
    except OSError as error:
        raise UsageError(f"{path}: cannot be written ({error.strerror or error}).") from error
