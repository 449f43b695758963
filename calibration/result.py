"""A calibration result as data with provenance, and its TOML text."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path


@dataclass(frozen=True, slots=True)
class Quantity:
    """One calibrated number."""

    value: float
    std: float
    """One standard deviation, same unit; NaN where it is not known."""
    unit: str


@dataclass(frozen=True, slots=True)
class Provenance:
    """Where a result comes from."""

    recording: str
    recording_sha256: str
    made_utc: datetime


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """Quantities by name with their provenance, residual and whatever else should be kept."""

    title: str
    provenance: Provenance
    quantities: Mapping[str, Quantity]
    residual: Mapping[str, Quantity] = field(default_factory=dict)
    notes: Mapping[str, float | int | str | bool | Sequence[str]] = field(default_factory=dict)

    def to_toml(self) -> str:
        """Return the result as TOML; the names are stable, other programs read them."""
        lines = [
            f"# {self.title}",
            "",
            f"made_utc = {self.provenance.made_utc.isoformat(timespec='seconds')}",
        ]
        lines += [f"recording = {_text(self.provenance.recording)}"]
        lines += [f"recording_sha256 = {_text(self.provenance.recording_sha256)}"]
        lines += [f"{name} = {_value(value)}" for name, value in self.notes.items()]
        for table, quantities in (("", self.quantities), ("residual.", self.residual)):
            for name, quantity in quantities.items():
                lines += ["", f"[{table}{name}]", f"value = {_number(quantity.value)}"]
                if not math.isnan(quantity.std):
                    lines.append(f"std = {_number(quantity.std)}")
                lines.append(f"unit = {_text(quantity.unit)}")
        return "\n".join(lines) + "\n"


def provenance_of(recording: Path, now_utc: datetime) -> Provenance:
    """Describe a file, or the files of a folder, by name and hash."""
    files = (
        sorted(p for p in recording.iterdir() if p.suffix == ".csv") if recording.is_dir() else [recording]
    )
    digest = hashlib.sha256()
    for file in files:
        if file.name != "truth.csv":  # a reference is not part of what was measured
            digest.update(file.name.encode())
            digest.update(file.read_bytes())
    return Provenance(recording.name, digest.hexdigest(), now_utc)


def _number(value: float) -> str:
    if math.isnan(value):
        return "nan"
    if math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return repr(float(f"{value:.9g}"))


def _text(value: str) -> str:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ")
    return f'"{escaped}"'


def _value(value: float | int | str | bool | Sequence[str]) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, str):
        return _text(value)
    return "[" + ", ".join(_text(item) for item in value) + "]"
