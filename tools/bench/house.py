"""What the processes of a live run cost: seconds until all are ready, CPU and memory by group.

    .venv/bin/python tools/bench/house.py
    .venv/bin/python tools/bench/house.py --seconds 20 --runs 3 --before ../commit_before

Flies the rig of ``make run`` headless and recorded, with the interpreter of the checkout that is measured
(``.venv`` in it). With --before, runs of both checkouts alternate, so that a machine that grows busy treats
them alike, and the ratio after to before of the medians is printed. The emulated laboratory stands for
hardware and is counted apart. Linux only: the figures come from ``/proc``.

CPU is that of the window of --seconds that begins --settle seconds after all processes were ready, when the
vehicles fly; memory (PSS: shared pages count in parts) is read at the end of the window.
"""

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))  # run as a file of its own
from bench.flown_rig import EMULATOR, GROUPS, LAUNCHER, HouseError, flown, pss_mb
from bench.processes import read
from bench.rows import ROOT, Bench, Row

RIG = Path("examples/rigs/two_mock_ups.toml")
STATION = "station, all"
SECONDS, SETTLE_S, RUNS = 20.0, 12.0, 3
LIMITS = {"ready, s": 4.0, f"CPU, cores: {LAUNCHER}": 0.08}
"""Of figures, on the machine of docs/benchmarks.md."""
RATIO_LIMITS = {f"CPU, cores: {STATION}": 0.5, f"PSS, MB: {STATION}": 0.5}
"""Of figures to those of the checkout before."""
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


@dataclass(frozen=True)
class Cost:
    """One run of one checkout.

    Attributes:
        ready_s: From the start of the command until it printed that all processes are ready.
        cpu_cores: CPU seconds a second, by group.
        pss_mb: Proportional set size in MB, by group.
        total_cpu_s: CPU seconds that the station's processes had used when all were ready.
    """

    ready_s: float
    cpu_cores: dict[str, float]
    pss_mb: dict[str, float]
    total_cpu_s: float


def run_once(checkout: Path, rig: Path, seconds: float, settle_s: float) -> Cost:
    """Fly once and measure.

    Args:
        checkout: Where ``.venv`` and the rig are.
        rig: Rig file, relative to the checkout.
        seconds: Length of the window.
        settle_s: From ready to the beginning of the window.

    Raises:
        HouseError: The run was none to measure.
    """
    with flown(checkout, rig) as run:
        first = run.groups()
        total_cpu_s = sum(_cpu_s(first[name]) for name in GROUPS if name in first)
        time.sleep(settle_s)  # the vehicles rest, then fly: the window looks at flying ones
        groups = run.groups()
        from_s, cpu_from_s = time.monotonic(), {name: _cpu_s(pids) for name, pids in groups.items()}
        time.sleep(seconds)
        cpu_s = {name: _cpu_s(pids) - cpu_from_s[name] for name, pids in groups.items()}
        took_s = time.monotonic() - from_s
        memory_mb = {name: sum(map(pss_mb, pids)) for name, pids in groups.items()}
        run.check_still(groups)
    cpu_cores = {name: used / took_s for name, used in cpu_s.items()}
    return Cost(run.ready_s, cpu_cores, memory_mb, total_cpu_s)


def _cpu_s(pids: Iterable[int]) -> float:
    """User and system time of the processes themselves."""
    total = 0
    for pid in pids:
        fields = read(pid, "stat").rpartition(")")[2].split()
        total += sum(map(int, fields[11:13]))  # utime, stime
    return total * _TICK_S


def _medians(costs: list[Cost]) -> dict[str, float]:
    """Figures of a checkout, over its runs."""
    figures = {
        "ready, s": statistics.median(cost.ready_s for cost in costs),
        "CPU until ready, s": statistics.median(cost.total_cpu_s for cost in costs),
    }
    for title, by_group in (
        ("CPU, cores", [cost.cpu_cores for cost in costs]),
        ("PSS, MB", [cost.pss_mb for cost in costs]),
    ):
        for name in GROUPS:
            if any(name in row for row in by_group):
                figures[f"{title}: {name}"] = statistics.median(row.get(name, 0.0) for row in by_group)
        of_station = [sum(row.get(name, 0.0) for name in GROUPS) for row in by_group]
        figures[f"{title}: {STATION}"] = statistics.median(of_station)
        figures[f"{title}: {EMULATOR}"] = statistics.median(row.get(EMULATOR, 0.0) for row in by_group)
    return figures


def _table(after: dict[str, float], before: dict[str, float]) -> str:
    """The figures of one or both checkouts, with their ratio."""
    lines = [f"{'':34}{'before':>10}{'now':>10}{'ratio':>8}" if before else f"{'':34}{'now':>10}"]
    for name in after | before:
        cells = [name.ljust(34)]
        if before:
            cells.append(_cell(before.get(name)))
        cells.append(_cell(after.get(name)))
        if before.get(name) and name in after:
            cells.append(f"{after[name] / before[name]:8.2f}")
        lines.append("".join(cells))
    return "\n".join(lines)


def _cell(value: float | None) -> str:
    return f"{value:10.3f}" if value is not None else f"{'-':>10}"


def measure(bench: Bench) -> list[Row]:
    """What processes cost, of this checkout and, in turn with it, of the one before where one was named."""
    checkouts = {"now": ROOT} if bench.before is None else {"before": bench.before.absolute(), "now": ROOT}
    costs = _fly(checkouts, RIG, SECONDS, SETTLE_S, RUNS, bench.say)
    now = _medians(costs["now"])
    before = _medians(costs["before"]) if "before" in costs else {}
    rows = []
    for name, figure in now.items():
        most, most_ratio = LIMITS.get(name), RATIO_LIMITS.get(name)
        ratio = figure / before[name] if before.get(name) else None
        limits = [f"{most:g}"] if most is not None else []
        limits += [f"{most_ratio:g} of before"] if most_ratio is not None else []
        verdicts = [figure <= most] if most is not None else []
        verdicts += [ratio <= most_ratio] if most_ratio is not None and ratio is not None else []
        beside = "" if ratio is None else f" ({ratio:.2f} of {before[name]:.3g})"
        rows.append(
            Row(name, ", ".join(limits), f"{figure:.3g}{beside}", all(verdicts) if verdicts else None)
        )
    return rows


def _fly(
    checkouts: Mapping[str, Path],
    rig: Path,
    seconds: float,
    settle_s: float,
    runs: int,
    say: Callable[[str], None],
) -> dict[str, list[Cost]]:
    """Runs of all checkouts in turn."""
    costs: dict[str, list[Cost]] = {name: [] for name in checkouts}
    for number in range(runs):
        for name, checkout in checkouts.items():
            cost = run_once(checkout, rig, seconds, settle_s)
            costs[name].append(cost)
            say(
                f"run {number + 1}, {name}: ready in {cost.ready_s:.2f} s, "
                f"{sum(cost.cpu_cores.get(group, 0.0) for group in GROUPS):.2f} cores, "
                f"{sum(cost.pss_mb.get(group, 0.0) for group in GROUPS):.0f} MB"
            )
    return costs


def main() -> None:
    """Parse the words, fly, print."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--checkout", type=Path, default=ROOT, help="what is measured (default: this one)")
    words.add_argument(
        "--before", type=Path, help="another checkout to compare with, with a .venv of its own"
    )
    words.add_argument("--rig", type=Path, default=RIG, help="rig file, relative to the checkouts")
    words.add_argument("--seconds", type=float, default=20.0, help="length of the window")
    words.add_argument("--settle", type=float, default=12.0, help="seconds from ready to the window")
    words.add_argument("--runs", type=int, default=1, help="runs of each checkout; medians are printed")
    arguments = words.parse_args()
    checkouts = {"now": arguments.checkout.absolute()}
    if arguments.before is not None:
        checkouts = {"before": arguments.before.absolute(), **checkouts}
    for checkout in checkouts.values():
        if not (checkout / ".venv" / "bin" / "groundstation").exists():
            words.error(f"{checkout} has no .venv/bin/groundstation: run `make` there first")
    try:
        costs = _fly(
            checkouts,
            arguments.rig,
            arguments.seconds,
            arguments.settle,
            arguments.runs,
            lambda line: print(line, flush=True),
        )
    except HouseError as error:
        sys.exit(f"house: {error}")
    before = _medians(costs["before"]) if "before" in costs else {}
    print(_table(_medians(costs["now"]), before))


if __name__ == "__main__":
    main()
