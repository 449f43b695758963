"""What a recording of a rig says about itself."""

import hashlib
from pathlib import Path

from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.software import software
from groundstation.runtime.estimation import calibration_files
from groundstation.runtime.rig import Rig


def calibration_hashes(rig: Rig) -> dict[str, str]:
    """SHA-256 of every calibration file in use, by the name that the rig gives it."""
    hashes = {}
    for name, mock_up in rig.mock_ups.items():
        if mock_up.star_camera is not None:
            for role in ("camera", "ceiling", "delay_file"):
                path: Path | None = getattr(mock_up.star_camera, role)
                if path is not None and path.exists():
                    hashes[f"{name}.{role}"] = hashlib.sha256(path.read_bytes()).hexdigest()
    for name, path in calibration_files(rig):
        if path.exists():
            hashes[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return hashes


def recording_info(rig: Rig, rig_path: Path, seed: int | None, utc_offset_ns: int | None) -> RecordingInfo:
    """Provenance of a recording of this rig."""
    return RecordingInfo(
        rig_toml=rig_path.read_text(),
        rig_path=str(rig_path.resolve()),
        images=ImagePolicy(rig.record.images),
        calibration_sha256=calibration_hashes(rig),
        seed=seed,
        software=software(),
        utc_offset_ns=utc_offset_ns,
    )
