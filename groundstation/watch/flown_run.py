"""Everything that a report knows of one run, read from its recording."""

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.declarations.errors import UsageError
from groundstation.declarations.tables import Tables
from groundstation.parts.valves.pulses import impulse_ns
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.watch.rig_facts import RigFacts, rig_facts
from groundstation.watch.run_events import TAKEN, EventLog, Mark
from groundstation.watch.summary import VehicleReport, read_reports
from groundstation.watch.tracks import Array, Track


@dataclass(frozen=True, slots=True)
class FlownRun:
    """One run.

    Attributes:
        name: Of the recording's file, or of the run's folder.
        sha256: Of the recording's file, or of its files one after the other.
        duration_s: Of the recording.
        info: What the recording states about itself.
        missing: What a recovery left out of it, in sentences.
        rig: What its rig states.
        vehicles: Tracks and numbers.
        marks: What happened; times in s since the recording began.
    """

    name: str
    sha256: str
    duration_s: float
    info: RecordingInfo
    missing: tuple[str, ...]
    rig: RigFacts
    vehicles: dict[str, VehicleReport]
    marks: list[Mark]

    @property
    def tracks(self) -> dict[str, Track]:
        """By vehicle."""
        return {name: report.track for name, report in self.vehicles.items()}

    @property
    def aloft_s(self) -> float:
        """When the last vehicle flew first; NaN if one of them never did."""
        moments = [_first_flight(report.track) for report in self.vehicles.values()]
        return math.nan if any(math.isnan(moment) for moment in moments) else max(moments)

    def gas(self, vehicle: str) -> Array:
        """Rows of t (s) and newton-seconds so far, by the nominal thrust of the rig; shape (n, 2)."""
        rows, valves = self.vehicles[vehicle].track.on_times, self.rig.valves.get(vehicle)
        if valves is None:
            return np.empty((0, 2))
        return np.column_stack([rows[:, 0], impulse_ns(rows[:, 0], rows[:, 1:], valves.thrust_n)])

    def numbers(self, vehicle: str) -> dict[str, Any]:
        """Those of the parts, and what takes the rig to know."""
        gas = self.gas(vehicle)
        return {**self.vehicles[vehicle].numbers, "gas_ns": float(gas[-1, 1]) if len(gas) else math.nan}


def read_run(path: Path, tables: Tables) -> FlownRun:
    """Read a recording.

    Args:
        path: An ``.mcap`` file, or the folder of a run.
        tables: Of the parts whose figures are wanted.

    Raises:
        UsageError: It holds no vehicle's state.
        RecordingError: It cannot be read.
    """
    log = EventLog()
    with Recording(path) as source:
        reports = read_reports(tables, source, TAKEN, log)
        duration_s = (source.stop_ns - source.start_ns) * 1e-9
        info, missing, files = source.info, tuple(source.missing()), source.files
    if not reports:
        raise UsageError(f"{path}: holds no vehicle state, so there is nothing to report")
    sha256 = hashlib.sha256()
    for each in files:
        with each.open("rb") as file:
            hashlib.file_digest(file, lambda: sha256)
    rig = rig_facts(info.rig_toml)
    return FlownRun(
        path.name or path.resolve().name,
        sha256.hexdigest(),
        duration_s,
        info,
        missing,
        rig,
        reports,
        log.marks(duration_s),
    )


def _first_flight(track: Track) -> float:
    return next((t_s for t_s, mode in track.modes if mode == "flying"), math.nan)
