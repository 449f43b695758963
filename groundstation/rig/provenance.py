"""What a recording of a rig says about itself, and how its rig is found again.

A rig file below the working directory is recorded by its relative path: such a recording names no folder
of the machine, and is replayed from any copy of the project.
"""

import os
from pathlib import Path

from groundstation.declarations.errors import RigError
from groundstation.declarations.rig import Rig
from groundstation.files.reading import path_of, text_of_path
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.reader import Recording
from groundstation.recording.software import software
from groundstation.rig.read import files_of, parse_rig


def file_hashes(rig: Rig) -> dict[str, str]:
    """SHA-256 of every file in use, by its key in the rig."""
    return {name: file.sha256 for name, file in files_of(rig).items()}


def recording_info(
    rig: Rig, rig_text: str, rig_path: Path, seed: int | None, utc_offset_ns: int | None
) -> RecordingInfo:
    """Provenance of a recording of this rig.

    Args:
        rig: As it was read.
        rig_text: Text of its file.
        rig_path: Where the file stands.
        seed: Of the emulated laboratory, None on real hardware.
        utc_offset_ns: UTC minus the clock of the stamps; None in virtual time.
    """
    return RecordingInfo(
        rig_toml=rig_text,
        rig_path=portable(rig_path),
        images=ImagePolicy(rig.record.images),
        calibration_sha256=file_hashes(rig),
        seed=seed,
        software=software(),
        utc_offset_ns=utc_offset_ns,
    )


def portable(rig_path: Path) -> str:
    """The path of a rig file as recordings carry it: relative to the working directory if it lies below."""
    found = rig_path.resolve()
    try:
        found = found.relative_to(Path.cwd())
    except ValueError:
        return text_of_path(found)
    return text_of_path(found).replace(os.sep, "/")


def recorded_rig(recording: Recording) -> Rig:
    """The rig of a recording, with its files as they are now.

    A relative path starts at the working directory or at one of the folders that hold the recording: where
    the files are those of the recording, else the first where they can be read.

    Raises:
        RigError: There is none, it is wrong, or a file that it names is found in none of these folders.
    """
    info = recording.info
    if not info.rig_toml:
        raise RigError(
            f"{recording.path} carries no rig: it was recorded without one, or a damage took the part of the "
            "file that held it"
        )
    usable: Rig | None = None
    refusal: RigError | None = None
    for path in _places(recording):
        try:
            rig = parse_rig(info.rig_toml, path)
        except RigError as error:
            refusal = refusal or error
            continue
        if not changed_files(rig, info):
            return rig
        usable = usable or rig
    if usable is not None:
        return usable
    assert refusal is not None  # there is always a place
    raise refusal


def changed_files(rig: Rig, info: RecordingInfo) -> list[str]:
    """One sentence for each file in use that is not the one of a recording."""
    found = []
    for name, file in files_of(rig).items():
        then = info.calibration_sha256.get(name, file.sha256)
        if then != file.sha256:
            found.append(
                f"calibration {name} is not the one of the recording: {file.path.name} has SHA-256 "
                f"{file.sha256[:12]}, recorded {then[:12]}"
            )
    return found


def _places(recording: Recording) -> list[Path]:
    """Where the rig file may stand: in folders that exist, or else where it stood."""
    path = path_of(recording.info.rig_path) if recording.info.rig_path else recording.path
    if path.is_absolute():
        return [path]
    places = [path, *(folder / path for folder in recording.path.resolve().parents)]
    return [place for place in places if place.parent.is_dir()] or [path]
