"""`calibrate laboratory` on emulated laboratories with hidden values: do they come back, are the sigmas true.

Flights are flown by `tools/laboratory_flights.py`, in lockstep; the command runs as a person runs it.
"""

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

from bench.rows import ROOT, Bench, Row

SEEDS = 20
MUST, AIM = 0.95, (0.6827, 0.9545, 0.9973)
FLIGHTS = ROOT / "tools" / "laboratory_flights.py"
COMMAND = "from groundstation.cli.main import main; main()"


def measure(bench: Bench) -> list[Row]:
    """A row for all values, and one per kind."""
    deviations: dict[str, list[float]] = {}
    unseen = 0
    for seed in range(1, SEEDS + 1):
        bench.say(f"laboratory_fit, seed {seed} of {SEEDS}")
        found, lost = compare(seed, bench.folder)
        unseen += lost
        for kind, values in found.items():
            deviations.setdefault(kind, []).extend(values)
    every = np.abs(np.concatenate([np.array(values) for values in deviations.values()]))
    within = float((every < 3.0).mean())
    what = f"laboratory fit, {SEEDS} seeds, {len(every)} hidden values"
    shares = " / ".join(f"{100.0 * float((every < size).mean()):.1f}" for size in (1.0, 2.0, 3.0))
    rows = [
        Row(f"{what}: within 3 sigma", f"{100.0 * MUST:g} %", f"{100.0 * within:.1f} %", within >= MUST),
        Row(
            f"{what}: within 1, 2, 3 sigma",
            "aim " + " / ".join(f"{100.0 * a:.1f}" for a in AIM),
            shares,
            None,
        ),
        Row("values that the flights did not tell", "", str(unseen), None),
    ]
    for kind, values in deviations.items():
        size = np.array(values)
        rms = math.sqrt(float((size**2).mean()))
        rows.append(
            Row(f"{kind}: error over sigma, RMS; worst", "", f"{rms:.2f}; {np.abs(size).max():.1f}", None)
        )
    return rows


def compare(seed: int, folder: Path) -> tuple[dict[str, list[float]], int]:
    """Fly a hidden laboratory, fit it: errors over sigma by kind of value, and how many were not told."""
    recording, out = folder / f"hidden_{seed}.mcap", folder / f"fitted_{seed}.toml"
    for words in (
        [str(FLIGHTS), str(seed), "--folder", str(folder)],
        ["-c", COMMAND, "calibrate", "laboratory", str(recording), "--out", str(out)],
    ):
        subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
    hidden = json.loads(recording.with_suffix(".json").read_text())
    fitted = json.loads(out.with_suffix(".json").read_text())
    for path in folder.glob(f"*_{seed}.*"):
        path.unlink()
    return errors_over_sigma(hidden, fitted)


def errors_over_sigma(hidden: dict, fitted: dict) -> tuple[dict[str, list[float]], int]:
    """Lay what was found beside what was hidden.

    Args:
        hidden: As `laboratory_flights` writes it.
        fitted: As `calibrate laboratory` writes it.
    """
    found = {**fitted["table"]["found"], **fitted["vehicles"]["alpha"]["found"]}
    deviations: dict[str, list[float]] = {}
    unseen = 0
    for kind, keys, truth in truths(hidden):
        for key, value in zip(keys, truth, strict=True):
            if key in found:
                error = (found[key]["value"] - value) / found[key]["std"]
                deviations.setdefault(kind, []).append(error)
            else:
                unseen += 1
    return deviations, unseen


def truths(hidden: dict) -> list[tuple[str, list[str], list[float]]]:
    """Each kind of value, its keys and the hidden values."""
    rows = [
        ("thrust", [f"thrusters.{valve}.thrust_n" for valve in range(8)], list(hidden["thrust_n"])),
        ("tilt", ["table.tilt_rad.x", "table.tilt_rad.y"], list(hidden["tilt_rad"])),
        ("inertia", ["inertia_kg_m2"], [0.25]),
    ]
    for section, keys in (
        ("valves", ("open_delay_s", "close_delay_s", "rise_s")),
        ("imu", ("gyro_noise_rad_s", "acc_noise_m_s2")),
        ("camera", ("delay_s", "delay_jitter_s", "sigma_xy_m", "sigma_heading_rad", "missing_fraction")),
    ):
        rows += [(key, [f"{section}.{key}"], [hidden[key]]) for key in keys]
    return rows
