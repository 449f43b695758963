"""Names of the recordings of one run: the first, and those that go on where it was split, full or killed."""

import re
from pathlib import Path

from groundstation.recording.errors import RecordingError

SUFFIX = ".mcap"
PART_SUFFIX = ".part"
FIRST_NAME = f"recording{SUFFIX}"
"""Of a run that has a folder."""


def next_name(first: Path) -> Path:
    """A name beside the first file of a run that nobody has taken: nothing recorded is overwritten."""
    number = 1
    while True:
        path = first.with_stem(f"{first.stem}_{number}")
        if not (path.exists() or part_of(path).exists()):
            return path
        number += 1


def part_of(path: Path) -> Path:
    """What a recording is called until it is finished."""
    return path.with_name(path.name + PART_SUFFIX)


def run_of(first: Path) -> tuple[list[Path], list[Path]]:
    """The recordings of a run that are there, in the order of their numbers: finished ones, and others.

    Args:
        first: The first one's name.
    """
    name = re.compile(
        rf"{re.escape(first.stem)}(?:_(\d+))?{re.escape(first.suffix)}({re.escape(PART_SUFFIX)})?"
    )
    found = []
    if first.parent.is_dir():
        for path in first.parent.iterdir():
            match = name.fullmatch(path.name)
            if match is not None:
                found.append((int(match[1] or 0), bool(match[2]), path))
    found.sort()
    return [path for _, torn, path in found if not torn], [path for _, torn, path in found if torn]


def files_of(path: Path) -> list[Path]:
    """The files to be read of a recording, or of the folder of a run.

    Raises:
        RecordingError: The folder holds none that was finished.
    """
    if not path.is_dir():
        return [path]
    finished, torn = run_of(path / FIRST_NAME)
    if finished:
        return finished
    if torn:
        raise RecordingError(f"{torn[0]} was not finished: try `groundstation recording recover {torn[0]}`")
    raise RecordingError(f"{path} is no folder of a run: it holds no {FIRST_NAME}")
