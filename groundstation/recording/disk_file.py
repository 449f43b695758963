"""The file that a recording is written to: it says in a sentence why it takes no more."""

import errno
import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from groundstation.recording.errors import NoRoomError, RecordingError
from groundstation.recording.file_place import place_of
from groundstation.recording.run_files import SUFFIX, part_of

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer


_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


def free_bytes(path: Path) -> int:
    """On the disk where a new file would be, for whoever is not root; folders that are not there are made.

    Raises:
        RecordingError: The disk is gone.
    """
    with on_disk(path):
        found = os.statvfs(next(parent for parent in path.absolute().parents if parent.exists()))
    return found.f_bavail * found.f_frsize


class DiskFile(io.FileIO):
    """A file that says in a sentence why it takes no more.

    The next piece then stands where the one began that did not find room: what was written of it stays until
    then, for whoever recovers the file.
    """

    _is_torn = False

    def free_bytes(self) -> int:
        """On its own disk, whatever its path leads to by now, for whoever is not root.

        Raises:
            RecordingError: The disk is gone.
        """
        with on_disk(Path(str(self.name))):
            found = os.fstatvfs(self.fileno())
        return found.f_bavail * found.f_frsize

    def place(self, supposed: Path) -> Path:
        """A path that leads to it now.

        Args:
            supposed: Where it was last.

        Raises:
            LostFileError: There is none.
            RecordingError: Its disk is gone.
        """
        with on_disk(supposed):
            return place_of(self.fileno(), supposed)

    def write(self, data: "ReadableBuffer", /) -> int:
        left, start = memoryview(data), self.tell()
        with on_disk(Path(str(self.name))):
            try:
                while left:
                    left = left[self._put(left) :]
                if self._is_torn:
                    self.truncate()
                    self._is_torn = False
            except OSError:
                self.seek(start)
                self._is_torn = True
                raise
        return len(memoryview(data))

    def _put(self, data: memoryview) -> int:
        return super().write(data)


@contextmanager
def on_disk(path: Path) -> Iterator[None]:
    """Write to a disk.

    Raises:
        NoRoomError: It is full.
        RecordingError: It is gone.
    """
    try:
        yield
    except OSError as error:
        kind = NoRoomError if error.errno in _FULL else RecordingError
        raise kind(f"{path} cannot be written any further: {error.strerror or error}") from error


def check_new_recording(path: Path) -> None:
    """Refuse a path to which no recording can be written, before any work is done.

    Raises:
        RecordingError: It does not end in ``.mcap``, is taken, too long, or lies behind a file.
    """
    if path.suffix != SUFFIX:
        raise RecordingError(f"{path} must end in {SUFFIX}: that is how viewers and reports know recordings")
    try:
        if path.exists():
            raise RecordingError(f"{path} is already there: recordings are never overwritten")
        part_of(path).exists()
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error.strerror}") from error
    behind = next((parent for parent in path.parents if parent.exists()), path)
    if not behind.is_dir():
        raise RecordingError(f"{path} cannot be written: {behind} is no folder")


def open_new(path: Path) -> DiskFile:
    """Begin a new recording under the name of its part; its folder is made.

    Raises:
        RecordingError: It, or what a killed recorder left of it, is already there, or it cannot be written.
    """
    part_path = part_of(path)
    check_new_recording(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if part_path.exists():
            raise RecordingError(
                f"{part_path} is left of a recording that was not finished: recover it or remove it first"
            )
        return DiskFile(part_path, "x")
    except OSError as error:
        raise RecordingError(f"{part_path} cannot be written: {error.strerror}") from error
