"""What every calibration of the sky gives back."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from calibration.result import CalibrationResult, Provenance, Quantity
from groundstation.star_tracking.camera_model import CameraCalibration

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Progress = Callable[[str, float], None]
"""Told what is going on and how much of it is done, 0 to 1; NaN where nobody knows."""


class CalibrationRefusedError(ValueError):
    """The data do not give the calibration; the message is one sentence that says what is missing."""


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """A calibration of the sky.

    Attributes:
        title: What was calibrated.
        summary: The result in one line, for people.
        quantities: Calibrated numbers by name, with one sigma.
        residual: How well the data fit.
        notes: Counts and names that belong to the record.
        draw: Makes the figure of the residuals; nothing is drawn before.
        warnings: What may be wrong although there is a result, one sentence each.
        camera: The camera with the new values; None if none of them are the camera's.
    """

    title: str
    summary: str
    quantities: Mapping[str, Quantity]
    residual: Mapping[str, Quantity]
    notes: Mapping[str, float | int | str | bool | Sequence[str]]
    draw: Callable[[], Figure]
    warnings: tuple[str, ...] = ()
    camera: CameraCalibration | None = field(default=None)

    def to_toml(self, provenance: Provenance) -> str:
        """The result as TOML, with where its data come from."""
        return CalibrationResult(self.title, provenance, self.quantities, self.residual, self.notes).to_toml()


def silent(what: str, share: float) -> None:
    """Tell nobody of the progress."""
    del what, share


def adjusting(progress: Progress) -> Callable[[int, float], None]:
    """Tell the steps of an adjustment, with their residual RMS in px, as progress."""

    def step(number: int, rms_px: float) -> None:
        progress(f"adjusting, step {number}, residual {rms_px:.3f} px", math.nan)

    return step
