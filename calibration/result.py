"""A calibration result as data with provenance, and its TOML text."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from groundstation.declarations.guide import Number
from groundstation.files.reading import open_file
from groundstation.files.toml_file import Value, toml_lines, toml_table


@dataclass(frozen=True, slots=True)
class Quantity:
    """One calibrated number."""

    value: float
    sigma: float
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
    """Quantities by name with their provenance, residual, verification and whatever else should be kept."""

    title: str
    provenance: Provenance
    quantities: Mapping[str, Quantity]
    residual: Mapping[str, Quantity] = field(default_factory=dict)
    notes: Mapping[str, float | int | str | bool | Sequence[str]] = field(default_factory=dict)
    verification: Mapping[str, Quantity] = field(default_factory=dict)

    def to_toml(self) -> str:
        """Return the result as TOML; the names are stable, other programs read them."""
        origin: dict[str, Value] = {
            "made_utc": self.provenance.made_utc,
            "recording": self.provenance.recording,
            "recording_sha256": self.provenance.recording_sha256,
        }
        lines = [f"# {self.title}", "", *toml_lines({**origin, **self.notes})]
        tables = (("", self.quantities), ("residual.", self.residual), ("verification.", self.verification))
        for table, quantities in tables:
            for name, quantity in quantities.items():
                sigma = {} if math.isnan(quantity.sigma) else {"std": quantity.sigma}
                lines += toml_table(table + name, {"value": quantity.value, **sigma, "unit": quantity.unit})
        return "\n".join(lines) + "\n"


def quantity_lines(quantities: Mapping[str, Number]) -> list[str]:
    """Return quantities in words, a line each."""
    lines = []
    for name, quantity in quantities.items():
        spread = "" if math.isnan(quantity.sigma) else f" ± {quantity.sigma:.2g}"
        lines.append(f"{name} = {quantity.value:.6g}{spread} {quantity.unit}")
    return lines


def provenance_of(
    recording: Path, now_utc: datetime | None = None, files: Sequence[Path] | None = None
) -> Provenance:
    """Describe what was read by name and hash.

    Args:
        recording: A file, or a folder.
        now_utc: When the result was made; now if None.
        files: What was read of a folder; its CSV files if None.
    """
    if files is None:
        # a reference is not part of what was measured
        found = (
            sorted(p for p in recording.iterdir() if p.suffix == ".csv")
            if recording.is_dir()
            else [recording]
        )
        files = [file for file in found if file.name != "truth.csv"]
    digest = hashlib.sha256()
    for file in files:
        digest.update(os.fsencode(file.name))
        with open_file(file) as content:
            while block := content.read(1 << 20):
                digest.update(block)
    return Provenance(recording.resolve().name, digest.hexdigest(), now_utc or datetime.now(UTC))


def provenance_of_several(recordings: Sequence[Path]) -> Provenance:
    """Describe recordings that were used together."""
    parts = [provenance_of(path) for path in recordings]
    if len(parts) == 1:
        return parts[0]
    digest = hashlib.sha256("".join(part.recording_sha256 for part in parts).encode()).hexdigest()
    return Provenance(", ".join(part.recording for part in parts), digest, parts[0].made_utc)
