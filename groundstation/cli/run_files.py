"""What a run leaves: recordings where they were asked for, or else a folder of its own."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from groundstation.cli.run_progress import RunProgress
from groundstation.declarations.errors import UsageError
from groundstation.declarations.rig import Rig
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.run_files import run_of
from groundstation.watch.run_folder import RunFolder, new_run_folder
from groundstation.watch.verdict import Verdict


def check_recording(path: Path) -> None:
    """Refuse a recording that cannot be read, before anything moves.

    Raises:
        UsageError: It says why.
    """
    try:
        Recording(path).close()
    except RecordingError as error:
        raise UsageError(str(error)) from error


def finished_files(*firsts: Path) -> tuple[list[Path], list[Path]]:
    """Name the files of a run; a recorder that was started again left several. Finished ones, and others.

    Args:
        firsts: Name of the first file, in each folder where the run was recorded.
    """
    found = [run_of(first) for first in firsts]
    finished = [path for paths, _ in found for path in paths]
    torn = [path for _, paths in found for path in paths]
    for path in finished:
        print(f"recording: {path}")
    for path in torn:
        print(f"not finished: {path} (groundstation recording recover brings back what it holds)")
    return finished, torn


@contextmanager
def kept_in(
    record: Path | None, rig: Rig, rig_text: str, name: str, scenario_text: str | None = None
) -> Iterator[tuple[Path, RunFolder | None]]:
    """Give the path of the recording, and the folder of the run where no recording was named.

    Args:
        record: Recording that was named.
        rig: That flies.
        rig_text: Its text.
        name: Of the rig or scenario: part of the folder's name.
        scenario_text: Of the scenario's file, where one is flown.

    Raises:
        FileError: The folder cannot be made.
    """
    if record is not None:
        yield record, None
        return
    folder = new_run_folder(rig.record.directory, time.strftime("%Y-%m-%d_%H-%M-%S"), name)
    try:
        folder.begin(rig, rig_text, scenario_text)
        yield folder.recording, folder
    finally:
        folder.discard_if_nothing_was_recorded()


def finish_folder(
    folder: RunFolder | None, finished: list[Path], verdict: Verdict | None = None
) -> RunFolder | None:
    """Write numbers, verdict and markers of a run that has a folder, and name it.

    Args:
        folder: As it was begun; None where a recording was named instead.
        finished: Files of the run.
        verdict: On the run, where a scenario was flown.

    Returns:
        The folder, where it is by now.
    """
    if folder is None or not finished:
        return folder
    if not folder.path.is_dir():
        folder = RunFolder(finished[0].parent)  # it was moved in flight
    try:
        with RunProgress(1.0) as progress:
            missing = folder.finish(progress, verdict)
    except RecordingError as error:
        missing = [f"its numbers are not there: {error}"]
    for sentence in missing:
        sys.stderr.write(f"groundstation: {sentence}\n")
    print(f"run: {folder.path}")
    return folder
