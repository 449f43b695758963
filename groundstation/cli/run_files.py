"""Recordings that a run has left, or is to be compared with."""

from pathlib import Path

from groundstation.declarations.errors import UsageError
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.writer import PART_SUFFIX


def check_recording(path: Path) -> None:
    """Refuse a recording that cannot be read, before anything moves.

    Raises:
        UsageError: It says why.
    """
    try:
        Recording(path).close()
    except RecordingError as error:
        raise UsageError(str(error)) from error


def finished_files(recording: Path) -> tuple[list[Path], list[Path]]:
    """Name the files of a run; a recorder that was started again left several. Finished ones, and others."""
    every = [recording, *sorted(recording.parent.glob(f"{recording.stem}_[0-9]*{recording.suffix}*"))]
    torn = recording.with_name(recording.name + PART_SUFFIX)
    finished = [path for path in every if path.suffix == recording.suffix and path.exists()]
    for path in finished:
        print(f"recording: {path}")
    left = [path for path in [torn, *every] if path.name.endswith(PART_SUFFIX) and path.exists()]
    for path in left:
        print(f"not finished: {path} (groundstation recording recover brings back what it holds)")
    return finished, left
