"""Where a rig's last modes are kept, so that a stop outlives every process, the launcher's included."""

import fcntl
import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

from groundstation.declarations.errors import GroundStationError
from groundstation.declarations.kept_file import EXPECTED

MOST_RUNS = 64
"""Of one emulated rig at a time."""


@dataclass(slots=True)
class Memory:
    """The folder of one run, which no other run uses meanwhile.

    Attributes:
        folder: Of the files.
        lock: Descriptor of the lock file, held until the run is over, however it ends.
    """

    folder: Path
    lock: int

    def address(self, *, has_kept: bool) -> str:
        """Where a process finds it; one that ran before must find what it kept then."""
        return f"{self.folder}{f'?{EXPECTED}' if has_kept else ''}"

    def forget(self) -> None:
        """Forget what was kept: a newly started emulated laboratory starts fresh.

        Raises:
            GroundStationError: It cannot be removed.
        """
        for path in self.folder.glob("*.json"):
            try:
                path.unlink(missing_ok=True)
            except OSError as error:
                raise GroundStationError(f"{path} cannot be removed: {error.strerror}") from error

    def release(self) -> None:
        """Let other runs have it."""
        os.close(self.lock)


def claim_memory(rig_path: Path, *, is_emulated: bool) -> Memory:
    """The folder of one rig file, made if it is not there: in XDG_STATE_HOME, else in the home folder.

    Runs of an emulated rig have mock-ups of their own, so each gets a folder of its own.

    Raises:
        GroundStationError: It cannot be made, or another run flies the same mock-ups.
    """
    base = os.environ.get("XDG_STATE_HOME", "")
    state = Path(base) if base and Path(base).is_absolute() else Path.home() / ".local" / "state"
    path = rig_path.resolve()
    name = f"{path.stem}-{hashlib.sha256(os.fsencode(path)).hexdigest()[:12]}"
    for number in range(MOST_RUNS if is_emulated else 1):
        folder = state / "groundstation" / (f"{name}-{number}" if number else name)
        found = _claim(folder)
        if found is not None:
            return found
    raise GroundStationError(f"another run flies the mock-ups of {rig_path}: end it first")


def _claim(folder: Path) -> Memory | None:
    """The folder, or None where another run has it."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        lock = os.open(folder / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise GroundStationError(
            f"{folder} cannot be used ({error.strerror}): stops would not outlive a restart; "
            "set XDG_STATE_HOME to a folder that can be written"
        ) from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        return None
    return Memory(folder, lock)
