"""Seconds of flight per second of CPU in lockstep, as the command flies: with recording and ledger."""

from bench.rows import RIGS, Bench, CpuTime, Row
from groundstation.runtime.lockstep_run import make_runner, run_lockstep
from groundstation.runtime.rig import load_rig

CASES = (
    ("fixes drawn from truth", "drawn_fixes.toml", 120.0, 40.0),
    ("rendered sky, tracker busy 0.6 s", "published.toml", 40.0, 5.0),
    ("rendered sky, all 15 frames/s solved", "late_pipeline.toml", 40.0, 5.0),
)
"""What, rig of one mock-up, virtual seconds, times real time."""


def measure(bench: Bench) -> list[Row]:
    """One row per case."""
    rows = []
    for what, name, flown_s, limit in CASES:
        rig = RIGS / name
        loaded = load_rig(rig)
        path = bench.folder / f"speed_{rig.stem}.mcap"

        def progress(text: str, done: float, what: str = what) -> None:
            del done
            bench.say(f"lockstep, {what}: {text}")

        with CpuTime() as cpu:
            run_lockstep(loaded, rig, path, flown_s, 1, progress)
        times = flown_s / cpu.seconds
        measured = f"{times:.1f}x ({bench.in_units(cpu.seconds / flown_s)} per second flown)"
        rows.append(
            Row(f"lockstep, one mock-up, {what}", f"{limit:.0f}x real time", measured, times >= limit)
        )
    return [*rows, _unrecorded(bench)]


def _unrecorded(bench: Bench) -> Row:
    """What is left without observers: nodes, runner and emulator."""
    what, name, flown_s, _ = CASES[0]
    bench.say(f"lockstep, {what}, nothing recorded")
    with CpuTime() as cpu:
        runner = make_runner(load_rig(RIGS / name), 1, [])
        runner.run(round(flown_s * 1e9))
        runner.close()
    measured = f"{flown_s / cpu.seconds:.1f}x ({bench.in_units(cpu.seconds / flown_s)} per second flown)"
    return Row(f"lockstep, one mock-up, {what}, nothing recorded", "", measured, None)
