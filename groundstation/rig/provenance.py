"""What a recording of a rig states about itself."""

from pathlib import Path

from groundstation.declarations.rig import Rig
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.software import software
from groundstation.rig.read import files_of


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
        rig_path=str(rig_path.resolve()),
        images=ImagePolicy(rig.record.images),
        calibration_sha256=file_hashes(rig),
        seed=seed,
        software=software(),
        utc_offset_ns=utc_offset_ns,
    )
