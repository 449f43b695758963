"""The folder of a run: the recording, and all that it takes to understand it next week.

recording.mcap        and recording_1.mcap ..., where it was split or begun again
rig.toml              as it was flown
scenario.toml         as it was read, where one was flown
files/                what the rig names: calibrations, ceilings, maps; by their keys in the rig
run.json              when, versions, hashes of the files
notes.md              markers; people write on
report.json           numbers and verdict, as `groundstation report` writes them
"""

import json
import platform
import re
from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from groundstation.declarations.errors import UsageError
from groundstation.declarations.rig import Rig
from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes
from groundstation.files.writing import check_folder, write_file
from groundstation.recording.run_files import FIRST_NAME, run_of
from groundstation.recording.software import software
from groundstation.rig.read import files_of
from groundstation.watch.run_events import Mark
from groundstation.watch.verdict import MARKER, Verdict

Progress = Callable[[str, float], None]
REPORT, NOTES, RUN, RIG, SCENARIO, FILES = (
    "report.json", "notes.md", "run.json", "rig.toml", "scenario.toml", "files",
)  # fmt: skip
_LIBRARIES = ("numpy", "scipy", "opencv-python-headless", "eclipse-zenoh", "mcap")
_LONGEST_NAME = 60


class RunFolder:
    """One folder.

    Args:
        path: Made by ``begin``.

    Attributes:
        path: Of the folder.
        recording: Where the recorder writes first.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.recording = path / FIRST_NAME
        self._written: list[Path] = []

    def begin(self, rig: Rig, rig_text: str, scenario_text: str | None = None) -> None:
        """Write all that is known before anything moves.

        Args:
            rig: That flies.
            rig_text: Its text.
            scenario_text: Of the scenario's file, where one is flown.

        Raises:
            FileError: The folder cannot be made or written.
        """
        check_folder(self.path)
        files = files_of(rig)
        try:
            (self.path / FILES).mkdir(parents=True)
        except OSError as error:
            raise FileError(
                f"{self.path}: no such folder can be made ({error.strerror or error})."
            ) from error
        self._write(RIG, rig_text)
        if scenario_text is not None:
            self._write(SCENARIO, scenario_text)
        for key, file in files.items():
            self._write(f"{FILES}/{key}{file.path.suffix}", file.data)
        self._write(RUN, _as_text(_run(rig, {key: file.sha256 for key, file in files.items()})))
        if not files:
            (self.path / FILES).rmdir()

    def finish(self, progress: Progress, verdict: Verdict | None = None) -> list[str]:
        """Write what the run became: its numbers, verdict and markers.

        Args:
            progress: Takes what is being done, and the share that is done.
            verdict: On the run, where a scenario was flown.

        Returns:
            Sentences about what is not there.

        Raises:
            RecordingError: The recording cannot be read.
            FileError: The folder cannot be written.
        """
        from groundstation.watch.report import numbers_of  # what draws pages, which a start has not

        marks: list[Mark] = []
        missing = []
        try:
            numbers, marks, zero_s = numbers_of(self.path, progress, verdict)
            write_file(self.path / REPORT, numbers)
            marks = [Mark(m.t_s - zero_s, None, m.kind, m.vehicle, m.text) for m in marks if m.kind == MARKER]
        except UsageError as error:
            missing.append(f"there is no {REPORT}: {error}")
        write_file(self.path / NOTES, _notes(self.path.name, marks))
        return missing

    def discard_if_nothing_was_recorded(self) -> bool:
        """Leave no folder without a recording; whether it is gone. What somebody else has put there stays."""
        finished, torn = run_of(self.recording)
        if finished or torn:
            return False
        for path in self._written:
            with suppress(OSError):
                path.unlink()
        for folder in (self.path / FILES, self.path):
            with suppress(OSError):  # it is not empty
                folder.rmdir()
        return not self.path.exists()

    def _write(self, name: str, content: str | bytes) -> None:
        """Write one of its files."""
        self._written.append(self.path / name)
        write_file(self.path / name, content)


def new_run_folder(directory: Path, stamp: str, name: str) -> RunFolder:
    """A folder that nobody has taken, such as ``recordings/2026-03-01_14-05-00_two_mock_ups``.

    Args:
        directory: Of all runs.
        stamp: Date and time.
        name: Of the rig or scenario.
    """
    word = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").lower()[:_LONGEST_NAME].rstrip("_") or "run"
    path, number = directory / f"{stamp}_{word}", 1
    while path.exists():
        number += 1
        path = directory / f"{stamp}_{word}_{number}"
    return RunFolder(path)


def _run(rig: Rig, hashes: dict[str, str]) -> dict[str, Any]:
    return {
        "begun_utc": datetime.now(UTC).isoformat(timespec="seconds"),
        "rig": rig.name,
        "vehicles": list(rig.vehicles),
        "versions": {
            "groundstation": software(),
            "python": platform.python_version(),
            "system": platform.platform(),
            **{name: _version(name) for name in _LIBRARIES},
        },
        "files": {key: {"sha256": digest} for key, digest in hashes.items()},
    }


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _notes(name: str, markers: list[Mark]) -> str:
    lines = [f"# {name}", ""]
    lines += [f"- {mark.t_s:.1f} s: {mark.text}" for mark in markers]
    return "\n".join(lines) + "\n"


def _as_text(content: dict[str, Any]) -> str:
    return json.dumps(content, indent=1) + "\n"


def kept_words(path: Path) -> list[str]:
    """What the folder of a run keeps beside its recording, a line each: verdict, notes, files; no error.

    Args:
        path: Of the folder.
    """
    lines = []
    report = _read(path / REPORT)
    if "verdict" in report:
        reason = f": {report['reason']}" if report.get("reason") else ""
        lines.append(f"verdict: {report['verdict']}{reason}")
    kept = [name for name in (RIG, SCENARIO, RUN, REPORT, NOTES) if (path / name).is_file()]
    count = len(list((path / FILES).iterdir())) if (path / FILES).is_dir() else 0
    lines.append(f"beside it: {', '.join(kept)}" + (f", {count} files of the rig" if count else ""))
    try:
        notes = read_bytes(path / NOTES).decode().splitlines()
    except ValueError:
        notes = []
    return lines + [
        f"note: {line.removeprefix('- ')}" for line in notes if line.strip() and not line.startswith("#")
    ]


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(read_bytes(path))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
