"""What every calibration gives back, and how it refuses."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from calibration.result import CalibrationResult, Provenance, Quantity
from groundstation.cli.progress import Progress
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
    """

    title: str
    summary: str
    quantities: Mapping[str, Quantity]
    residual: Mapping[str, Quantity]
    notes: Mapping[str, Note]
    draw: Callable[[], Figure] | None = None
    warnings: tuple[str, ...] = ()
    camera: CameraCalibration | OverheadCamera | None = field(default=None)

    def to_toml(self, provenance: Provenance) -> str:
        """The result as TOML, with where its data come from."""
        return CalibrationResult(self.title, provenance, self.quantities, self.residual, self.notes).to_toml()


def adjusting(progress: Progress) -> Callable[[int, float], None]:
    """Tell the steps of an adjustment, with their residual RMS in px, as progress."""

    def step(number: int, rms_px: float) -> None:
        progress(f"adjusting, step {number}, residual {rms_px:.3f} px", math.nan)

    return step
