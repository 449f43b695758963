"""Where an open file is: people rename folders, delete files and unmount disks while they are written.

The name that a file was made by says nothing of that; its descriptor does.
"""

import os
from pathlib import Path

from groundstation.recording.errors import DeletedFileError, UnreachableFileError
from groundstation.recording.run_files import PART_SUFFIX


def place_of(descriptor: int, supposed: Path) -> Path:
    """A path that leads to an open file now.

    Args:
        descriptor: Of the file.
        supposed: Where it was last.

    Raises:
        DeletedFileError: It has no name any more.
        UnreachableFileError: It has one, but no path leads to it: its disk was unmounted, or another lies
            over it.
        OSError: Its disk is gone.
    """
    own = os.fstat(descriptor)
    if not own.st_nlink:
        raise DeletedFileError(f"{supposed} was deleted while it was written")
    for path in (supposed, _system_path(descriptor)):
        if path is not None and is_file(path, own):
            return path
    raise UnreachableFileError(
        f"no path leads to {supposed} any more: its disk was unmounted, or another lies over it"
    )


def is_file(path: Path, known: os.stat_result) -> bool:
    """Whether a path leads to a file of which this is known, and not to another of its name."""
    try:
        return os.path.samestat(path.stat(), known)
    except OSError:
        return False


def finished_name(part: Path) -> Path:
    """What a file is called once it is finished; one that people gave a name of their own keeps it."""
    return part.with_name(part.name.removesuffix(PART_SUFFIX)) if part.suffix == PART_SUFFIX else part


def _system_path(descriptor: int) -> Path | None:
    """Where the system says that it is; None where it does not say."""
    try:
        return Path(f"/proc/self/fd/{descriptor}").readlink()
    except OSError:
        return None
