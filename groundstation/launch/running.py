"""Where a running rig can be found: a small file per run in the user's run-time folder.

The file is written when the hub is open and removed when the run ends. A run that was killed leaves its
file behind; whoever looks for runs removes it then.
"""

import contextlib
import json
import os
import stat
import tempfile
from dataclasses import asdict, dataclass, field
from pathlib import Path

from groundstation.declarations.errors import GroundStationError, UsageError

STOPPED = b"T"
"""State of a process that a signal of job control has stopped, as proc(5) writes it."""


@dataclass(frozen=True)
class RunningRig:
    """One run.

    Attributes:
        pid: Of the launcher.
        rig: The rig's name.
        endpoint: Of the hub.
        vehicles: Names of its vehicles.
        recording: First file that its recorder was asked for; empty for none.
        recorder_stop: Why no recorder runs at present; empty where one does, and no part of which run it is.
    """

    pid: int
    rig: str
    endpoint: str
    vehicles: tuple[str, ...]
    recording: str = ""
    recorder_stop: str = field(default="", compare=False)

    @property
    def is_paused(self) -> bool:
        """Whether its process stands still (Ctrl-Z, SIGSTOP): then nothing that it is asked is answered."""
        try:
            status = Path(f"/proc/{self.pid}/stat").read_bytes()
        except OSError:  # it has ended, or this system shows no states
            return False
        return status.rpartition(b")")[2].split()[:1] == [STOPPED]  # a name may hold brackets itself

    def announce(self) -> Path:
        """Write the file that others find this run by.

        Raises:
            GroundStationError: The folder belongs to somebody else or cannot be written.
        """
        path = _folder() / f"{self.pid}.json"
        partial = path.with_suffix(".part")
        try:
            partial.write_text(json.dumps(asdict(self)))
            partial.replace(path)
        except OSError as error:
            raise GroundStationError(f"{path} cannot be written: {error.strerror}") from error
        return path


def find_running() -> list[RunningRig]:
    """Every run of this user that is going on, oldest process number first."""
    found = []
    for path in sorted(_folder().glob("*.json")):
        try:
            reported = json.loads(path.read_text())
            run = RunningRig(
                reported["pid"],
                reported["rig"],
                reported["endpoint"],
                tuple(reported["vehicles"]),
                str(reported.get("recording", "")),
                str(reported.get("recorder_stop", "")),
            )
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            continue  # being removed just now, or not ours
        if _lives(run.pid):
            found.append(run)
        else:
            path.unlink(missing_ok=True)
    return sorted(found, key=lambda run: run.pid)


def _folder() -> Path:
    """The user's own folder: in XDG_RUNTIME_DIR, else in the folder for temporary files."""
    base = os.environ.get("XDG_RUNTIME_DIR", "")
    if base and Path(base).is_dir() and os.access(base, os.W_OK):
        folder = Path(base) / "groundstation"
    else:
        folder = Path(tempfile.gettempdir()) / f"groundstation-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise GroundStationError(f"{folder} cannot be made: {error.strerror}") from error
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise GroundStationError(f"{folder} belongs to somebody else: remove it")
    return folder


def _lives(pid: int) -> bool:
    with contextlib.suppress(PermissionError):
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
    return True


def choose_runs(pid: int | None) -> list[RunningRig]:
    """Every run, or that of one process.

    Raises:
        UsageError: There is none.
    """
    runs = [run for run in find_running() if pid in (None, run.pid)]
    if not runs:
        whose = "" if pid is None else f" with process {pid}"
        raise UsageError(f"no rig is running{whose}: start one with `groundstation run`")
    return runs


def choose_run(vehicle: str, pid: int | None) -> RunningRig:
    """The run that flies a vehicle.

    Args:
        vehicle: Its name.
        pid: Process of the run, where several fly one of that name.

    Raises:
        UsageError: There is none, or more than one.
    """
    runs = choose_runs(pid)
    fitting = [run for run in runs if vehicle in run.vehicles]
    if not fitting:
        known = ", ".join(name for run in runs for name in run.vehicles)
        raise UsageError(f"no vehicle {vehicle!r} is running (running: {known})")
    if len(fitting) > 1:
        known = ", ".join(f"{run.pid} ({run.rig})" for run in fitting)
        raise UsageError(f"several rigs fly a {vehicle!r}: choose one with --pid: {known}")
    return fitting[0]
