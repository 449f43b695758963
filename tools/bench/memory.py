"""Memory of every process of a long live flight: what it has grown by once it has settled.

Two mock-ups with their cameras, headless and recorded, with gas for the whole flight. Each process's
proportional set size is read once a minute. The first third of the flight is not judged: the zero rest, first
pictures and first chunks fill what stays full. Take an hour: ``--live-minutes 60``.
"""

import re
import time
from pathlib import Path

import numpy as np

from bench.flown_rig import EMULATOR, flown, pss_mb
from bench.house import RIG
from bench.rows import ROOT, Bench, Row

PERIOD_S = 60.0
SETTLED_AFTER = 1.0 / 3.0
"""Of the flight."""
MOST_MB_PER_HOUR = 3.0
"""A process that keeps something of each of its messages grows by tens."""


def measure(bench: Bench) -> list[Row]:
    """One row per group of processes: memory at the end, and how fast it grew."""
    count = max(4, round(60.0 * bench.live_minutes / PERIOD_S))
    memory_mb: dict[str, list[float]] = {}
    with flown(ROOT, _with_gas(bench.folder)) as run:
        groups = run.groups()
        for minute in range(count):
            time.sleep(PERIOD_S)
            for name, pids in groups.items():
                memory_mb.setdefault(name, []).append(sum(map(pss_mb, pids)))
            bench.say(f"minute {minute + 1} of {count}: {sum(row[-1] for row in memory_mb.values()):.0f} MB")
        run.check_still(groups)
    return [_row(name, len(groups[name]), np.array(row)) for name, row in memory_mb.items()]


def _with_gas(folder: Path) -> Path:
    """The rig with tanks that last for hours: an empty one lands its vehicle after a quarter of an hour."""
    text = (ROOT / RIG).read_text().replace('"../../', f'"{ROOT}/')
    text, count = re.subn(r"(?m)^start_m = ", "valves = { tank_impulse_n_s = 20000.0 }\nstart_m = ", text)
    if not count:
        raise ValueError(f"{RIG} states no start of a mock-up")
    rig = folder / "with_gas.toml"
    rig.write_text(text)
    return rig


def _row(name: str, processes: int, memory_mb: np.ndarray) -> Row:
    minutes = len(memory_mb)
    filling = round(SETTLED_AFTER * minutes)
    settled = memory_mb[filling:]
    slope_mb_h = float(np.polyfit(np.arange(len(settled)) * PERIOD_S / 3600.0, settled, 1)[0])
    most_mb_h = MOST_MB_PER_HOUR * processes
    is_ours = name != EMULATOR
    return Row(
        f"memory of {name} ({processes}), {minutes} min live",
        f"at most {most_mb_h:g} MB an hour" if is_ours else "",
        f"{slope_mb_h:+.1f} MB an hour after the first {filling} min ({memory_mb[0]:.1f}, {settled[0]:.1f}, "
        f"{memory_mb[-1]:.1f} MB after 1, {filling + 1}, {minutes} min)",
        slope_mb_h <= most_mb_h if is_ours else None,
    )
