"""Where a rig's last modes are kept, so that a stop outlives every process, the launcher's included."""

import hashlib
import os
from pathlib import Path

from groundstation.declarations.errors import GroundStationError


def memory_folder(rig_path: Path) -> Path:
    """The folder of one rig file, made if it is not there: in XDG_STATE_HOME, else in the home folder.

    Raises:
        GroundStationError: It cannot be made.
    """
    base = os.environ.get("XDG_STATE_HOME", "")
    state = Path(base) if base and Path(base).is_absolute() else Path.home() / ".local" / "state"
    path = rig_path.resolve()
    name = f"{path.stem}-{hashlib.sha256(str(path).encode()).hexdigest()[:12]}"
    folder = state / "groundstation" / name
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        raise GroundStationError(
            f"{folder} cannot be made ({error.strerror}): stops would not outlive a restart; "
            "set XDG_STATE_HOME to a folder that can be written"
        ) from error
    return folder


def forget(folder: Path) -> None:
    """Forget what was kept: a newly started emulated laboratory starts fresh.

    Raises:
        GroundStationError: It cannot be removed.
    """
    for path in folder.glob("*.json"):
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise GroundStationError(f"{path} cannot be removed: {error.strerror}") from error
