"""MCAP recordings: writer, reader, recovery; ``open`` gives the topics of one as arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from groundstation.recording.opened import OpenedRecording


def open(path: Path | str) -> OpenedRecording:  # noqa: A001 - as in gzip.open: called with its module's name
    """Open a recording for notebooks and scripts: ``open("run.mcap")["alpha/state"].position_table_m``.

    Args:
        path: An ``.mcap`` file, or the folder of a run.

    Returns:
        Topics by name, with their fields as arrays; use it as a context manager, or close it.

    Raises:
        RecordingError: There is no such file, it is no recording, or it was never finished.
    """
    from pathlib import Path

    from groundstation.recording.opened import OpenedRecording

    return OpenedRecording(Path(path))
