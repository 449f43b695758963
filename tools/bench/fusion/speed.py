"""CPU time of the filter per packet and per late fix, and of the whole command."""

import resource
import subprocess
import sys
from pathlib import Path

from bench.fusion.data import SCENARIOS, folders_of
from bench.fusion.pace import pace
from bench.limits import at_most, plain, short
from bench.rows import ROOT, Bench, Row
from groundstation.fusion.error_state_filter import ErrorStateFilter

PACKET_US, FIX_MS, COMMAND_S = (5.0, 2.5), (0.5, 0.25), (3.0, 1.0)
REPEATS = 5


def measure(bench: Bench) -> list[Row]:
    """On 100 s at 100 Hz, fixes 0.6 s late."""
    folder = folders_of(bench, SCENARIOS[0])[0]
    bench.say("fusion: pace of the filter")
    found = pace(folder, ErrorStateFilter, REPEATS)
    packet_us, fix_ms, unit_ms = 1e6 * found.packet_s, 1e3 * found.fix_s, 1e3 * found.unit_s
    of_unit = f"units of {unit_ms:.3f} ms"
    per_packet, per_fix = (
        f"{short(time / found.unit_s)} {of_unit}" for time in (found.packet_s, found.fix_s)
    )
    rows = [
        at_most("fusion: CPU per IMU sample", packet_us, *PACKET_US, "us", per_packet),
        at_most("fusion: CPU per late fix, 0.6 s of buffer at 100 Hz", fix_ms, *FIX_MS, "ms", per_fix),
    ]
    command = [sys.executable, "-m", "groundstation", "fusion", "run", str(folder), "--out"]
    command.append(str(bench.folder / "estimate.csv"))
    bench.say("fusion: the whole command")
    what = "fusion: 100 s of data through the command, CPU"
    causal, smooth = _median_cpu_s(command), _median_cpu_s([*command, "--smooth"])
    return [
        *rows,
        at_most(what, causal, *COMMAND_S, "s", bench.in_units(causal)),
        plain(f"{what}, --smooth", smooth, "s", bench.in_units(smooth)),
    ]


def _median_cpu_s(command: list[str]) -> float:
    return sorted(_cpu_s(command) for _ in range(3))[1]


def _cpu_s(command: list[str]) -> float:
    """CPU time of a process from its start to its end."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, capture_output=True, cwd=Path(ROOT))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
