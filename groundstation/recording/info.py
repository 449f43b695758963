"""What a recording states about itself: the rig, the calibrations, the seed, the clock.

It travels as one MCAP metadata record, written first, so that even a torn file can be replayed.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from groundstation.recording.errors import RecordingError
from groundstation.recording.policy import ImagePolicy

METADATA_NAME = "groundstation"
FORMAT = 2
"""Of this program's recordings; 1 named topics in journals by the row of a table."""
_CALIBRATION = "calibration/"


@dataclass(frozen=True, slots=True)
class RecordingInfo:
    """Provenance of a recording.

    Attributes:
        rig_toml: The whole text of the rig file, empty if none was used.
        rig_path: Where the rig file stood: relative paths inside it are relative to its folder.
        images: What was kept of the cameras.
        calibration_sha256: Hash of each calibration file in use, by name.
        seed: Of the emulated laboratory, None on real hardware.
        software: Name and version of the program that recorded.
        utc_offset_ns: UTC minus the monotonic clock of the stamps at the start of the recording; None in
            virtual time, so that equal runs give equal files.
    """

    rig_toml: str = ""
    rig_path: str = ""
    images: ImagePolicy = ImagePolicy.SPOTS
    calibration_sha256: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    software: str = ""
    utc_offset_ns: int | None = None

    def to_metadata(self) -> dict[str, str]:
        """Keys and texts of the metadata record, in a fixed order."""
        out = {
            "format": str(FORMAT),
            "rig": self.rig_toml,
            "rig_path": self.rig_path,
            "images": self.images.value,
            "software": self.software,
            "clock": "virtual" if self.utc_offset_ns is None else "monotonic",
        }
        if self.utc_offset_ns is not None:
            out["utc_offset_ns"] = str(self.utc_offset_ns)
        if self.seed is not None:
            out["seed"] = str(self.seed)
        for name in sorted(self.calibration_sha256):
            out[_CALIBRATION + name] = self.calibration_sha256[name]
        return out

    @classmethod
    def from_metadata(cls, reported: Mapping[str, str]) -> "RecordingInfo":
        """Read a metadata record back; keys that are not there get their defaults.

        Raises:
            RecordingError: A number or the image policy cannot be read.
        """
        try:
            version = int(reported.get("format", "1"))
        except ValueError as error:
            raise RecordingError(f"metadata record {METADATA_NAME!r}: {error}") from error
        if version != FORMAT:
            raise RecordingError(
                f"it is of recording format {version}, this program reads format {FORMAT}: "
                f"use the version that recorded it ({reported.get('software', '') or 'unknown'})"
            )
        try:
            return cls(
                rig_toml=reported.get("rig", ""),
                rig_path=reported.get("rig_path", ""),
                images=ImagePolicy(reported.get("images", ImagePolicy.SPOTS)),
                calibration_sha256={
                    key.removeprefix(_CALIBRATION): value
                    for key, value in reported.items()
                    if key.startswith(_CALIBRATION)
                },
                seed=_optional_int(reported.get("seed")),
                software=reported.get("software", ""),
                utc_offset_ns=_optional_int(reported.get("utc_offset_ns")),
            )
        except ValueError as error:
            raise RecordingError(f"metadata record {METADATA_NAME!r}: {error}") from error


def _optional_int(text: str | None) -> int | None:
    return None if text is None else int(text)
