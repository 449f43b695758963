"""Station keeping against truth over seeds, in lockstep, faults off."""

from dataclasses import dataclass

import numpy as np

from bench.rows import RIGS, Bench, Row
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.rig.read import load_rig, read_text
from groundstation.watch.summary import read_reports

FLOWN_S = 120.0


@dataclass(frozen=True)
class Condition:
    """A rig and its limits."""

    what: str
    rig: str
    position_mm: float
    heading_deg: float


CONDITIONS = (
    Condition("published noise", "published_condition.toml", 10.0, 0.5),
    Condition("data-sheet noise", "datasheet.toml", 15.0, 1.0),
)


def measure(bench: Bench) -> list[Row]:
    """Two rows per condition; a limit is kept if the worst seed keeps it."""
    rows = []
    for condition in CONDITIONS:
        flown = [_fly(bench, condition, seed) for seed in range(1, bench.seeds + 1)]
        position_mm, heading_deg = np.array(flown).T
        what = f"station keeping, tracker busy 0.6 s, {condition.what}"
        rows += [
            _row(f"{what}: position RMS", position_mm, condition.position_mm, "mm"),
            _row(f"{what}: heading RMS", heading_deg, condition.heading_deg, "deg"),
        ]
    return rows


def _fly(bench: Bench, condition: Condition, seed: int) -> tuple[float, float]:
    rig, path = RIGS / condition.rig, bench.folder / f"{condition.what}_{seed}.mcap"

    def progress(text: str, done: float) -> None:
        del done
        bench.say(f"station keeping, {condition.what}, seed {seed} of {bench.seeds}: {text}")

    run_lockstep(load_rig(rig), read_text(rig), rig, path, FLOWN_S, seed, progress)
    with Recording(path) as recording:
        reports = read_reports(installed_tables(), recording)
    path.unlink()
    numbers = reports["alpha"].numbers
    return numbers["station_position_rms_mm"], numbers["station_heading_rms_deg"]


def _row(what: str, rms: np.ndarray, limit: float, unit: str) -> Row:
    pooled, worst = float(np.sqrt(np.mean(rms**2))), float(np.max(rms))
    measured = f"{pooled:.3g} {unit}, worst of {len(rms)} seeds {worst:.3g} {unit}"
    return Row(what, f"{limit:g} {unit}", measured, worst <= limit)
