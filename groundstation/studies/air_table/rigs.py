"""The two rigs and the scenarios of the study, as they lie in `examples`."""

from __future__ import annotations

from pathlib import Path

from groundstation.studies.flown import FlightRow
from groundstation.studies.study import DEFAULT, PUBLISHED

_HERE = Path(__file__).parents[1]
RIGS = {PUBLISHED: _HERE / "published.toml", DEFAULT: _HERE / "published_condition.toml"}
"""Of each side: the same condition, other methods."""
FLIGHTS = {
    name: FlightRow(_HERE / f"published_{name}.toml", RIGS) for name in ("perimeter", "rest", "pulses")
}
