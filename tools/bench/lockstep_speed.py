"""Seconds of flight per second of CPU in lockstep: nodes, runner and emulator, with and without recording."""

from bench.rows import RIGS, Bench, CpuTime, Row
from groundstation.launch.lockstep_run import run_lockstep
from groundstation.rig.read import load_rig, read_text
from groundstation.runners.make_runner import make_runner

DRAWN = "drawn_fixes.toml"
RECORDED, UNIT_S = 40.0, 0.011
CASES = (
    ("fixes drawn from truth", DRAWN, 120.0, 40.0),
    ("rendered sky, tracker busy 0.6 s", "published_condition.toml", 40.0, 5.0),
    ("rendered sky, all 15 frames/s solved", "late_pipeline.toml", 40.0, 5.0),
)
"""What, rig of one mock-up, virtual seconds, times real time (nothing recorded, as in campaigns)."""


def measure(bench: Bench) -> list[Row]:
    """Two rows per case: as campaigns fly, which the limit is for, and with recording and ledger."""
    rows = []
    for what, name, flown_s, limit in CASES:
        loaded = load_rig(RIGS / name)
        title = f"lockstep, one mock-up, {what}"
        bench.say(title)
        with CpuTime() as cpu:
            runner = make_runner(loaded, 1, [], journaled=False)
            runner.run(round(flown_s * 1e9))
            runner.close()
        times = flown_s / cpu.seconds
        measured = f"{times:.1f}x ({bench.in_units(cpu.seconds / flown_s)} per second flown)"
        rows.append(Row(title, f"{limit:.0f}x real time", measured, times >= limit))
        rows.append(_recorded(bench, title, name, flown_s))
    return rows


def _recorded(bench: Bench, title: str, name: str, flown_s: float) -> Row:
    """The same as the command flies it: every topic into a file, and the ledger."""
    rig = RIGS / name
    path = bench.folder / f"speed_{rig.stem}.mcap"

    def progress(text: str, done: float) -> None:
        del done
        bench.say(f"{title}, recorded: {text}")

    with CpuTime() as cpu:
        run_lockstep(load_rig(rig), read_text(rig), rig, path, flown_s, 1, progress)
    times = flown_s / cpu.seconds
    measured = f"{times:.1f}x ({bench.in_units(cpu.seconds / flown_s)} per second flown)"
    if name != DRAWN:
        return Row(f"{title}, recorded", "", measured, None)
    scaled = times * bench.unit_s / UNIT_S
    limit = f"{RECORDED:.0f}x where the unit is {1e3 * UNIT_S:.0f} ms"
    return Row(f"{title}, recorded", limit, f"{measured}, {scaled:.1f}x so scaled", scaled >= RECORDED)
