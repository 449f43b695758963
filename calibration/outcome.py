"""What every calibration gives back, and how it refuses."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from calibration.result import CalibrationResult, Provenance, Quantity
from groundstation.cli.progress import Progress
from groundstation.declarations.guide import Drawing
from groundstation.files.json_file import json_text
from groundstation.files.writing import Content
from groundstation.overhead.overhead_camera import OverheadCamera
from groundstation.star_tracking.camera_model import CameraCalibration

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Note = float | int | str | bool | Sequence[str]
"""What else belongs to the record."""


class CalibrationRefusedError(ValueError):
    """The data do not give the calibration; the message is one sentence that states what is missing."""


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """A calibration.

    Attributes:
        title: What was calibrated.
        summary: The result in a line or several, for people.
        quantities: Calibrated numbers by name, with one sigma.
        residual: How well the data fit.
        notes: Counts and names that belong to the record.
        draw: Makes the figure of the residuals, where there is one; nothing is drawn before.
        warnings: What may be wrong although there is a result, one sentence each.
        camera: The camera with the new values; None if none of them are a camera's.
        verification: How well data fit that had no part in the result; empty where none were set aside.
        verified_by: What those data are, in words.
        drawings: Residuals as plain numbers, for who leads a guided calibration.
        also: Further files by the ending of their names, beside the result.
    """

    title: str
    summary: str
    quantities: Mapping[str, Quantity]
    residual: Mapping[str, Quantity]
    notes: Mapping[str, Note]
    draw: Callable[[], Figure] | None = None
    warnings: tuple[str, ...] = ()
    camera: CameraCalibration | OverheadCamera | None = field(default=None)
    verification: Mapping[str, Quantity] = field(default_factory=dict)
    verified_by: str = ""
    drawings: Sequence[Drawing] = ()
    also: Mapping[str, Content] = field(default_factory=dict)

    def to_toml(self, provenance: Provenance) -> str:
        """The result as TOML, with where its data come from."""
        notes = {**self.notes, "verified_by": self.verified_by} if self.verified_by else self.notes
        return CalibrationResult(
            self.title, provenance, self.quantities, self.residual, notes, self.verification
        ).to_toml()

    def written(self, out: Path, source: str, sha256: str, made_utc: datetime) -> dict[Path, Content]:
        """The files of the result: the TOML, a camera and what else belongs to it under the same name."""
        contents: dict[Path, Content] = {out: self.to_toml(Provenance(source, sha256, made_utc))}
        if self.camera is not None:
            contents[out.with_suffix(".camera.json")] = json_text(self.camera.to_mapping())
        return contents | {out.with_suffix(ending): content for ending, content in self.also.items()}


def adjusting(progress: Progress) -> Callable[[int, float], None]:
    """Tell the steps of an adjustment, with their residual RMS in px, as progress."""

    def step(number: int, rms_px: float) -> None:
        progress(f"adjusting, step {number}, residual {rms_px:.3f} px", math.nan)

    return step
