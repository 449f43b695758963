"""Measure what the limits of the project speak of, print the table, say what is missed.

    make bench
    python tools/bench.py --only live --live-minutes 10
    python tools/bench.py --fresh-clone --live-minutes 10 --write docs/benchmarks.md

Exit code 1 if a limit is missed. Close other programs: on a busy machine a live run measures them.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # before NumPy loads: figures are per core

from bench import fresh_clone, live, lockstep_speed, other_benches, parser, station_keeping  # noqa: E402
from bench import table as bench_table  # noqa: E402
from bench.rows import Bench, Measure, Row  # noqa: E402
from bench.unit import reference_unit_s  # noqa: E402
from rich.console import Console  # noqa: E402

MEASURES: Mapping[str, Measure] = MappingProxyType(
    {
        "fresh_clone": fresh_clone.measure,
        "live": live.measure,
        "station_keeping": station_keeping.measure,
        "lockstep": lockstep_speed.measure,
        "parser": parser.measure,
        "others": other_benches.measure,
    }
)
"""THE TABLE of subjects, in the order of the rows."""
ON_REQUEST = frozenset({"fresh_clone"})


def run(arguments: argparse.Namespace) -> list[Row]:
    """Measure what was asked for; what breaks is a row that is not ok."""
    names = arguments.only or [name for name in MEASURES if name not in ON_REQUEST]
    if arguments.fresh_clone and "fresh_clone" not in names:
        names = ["fresh_clone", *names]
    console = Console(stderr=True)
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="bench_") as folder, console.status("reference unit") as status:
        unit_s = reference_unit_s()
        bench = Bench(Path(folder), arguments.live_minutes, arguments.seeds, unit_s, status.update)
        for name in names:
            status.update(name)
            found = MEASURES[name](bench)
            for row in found:
                status.console.print(" | ".join(row.cells), highlight=False, markup=False, soft_wrap=True)
            rows += found
    circumstances = bench_table.circumstances(unit_s, arguments.live_minutes, arguments.seeds)
    print(circumstances)
    print(bench_table.text(rows))
    if arguments.write is not None:
        bench_table.write(arguments.write, rows, circumstances)
    return rows


def main() -> None:
    """Parse the words and run."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--only", nargs="+", choices=list(MEASURES), help="these subjects only")
    words.add_argument("--fresh-clone", action="store_true", help="also clone, install and fly (minutes)")
    words.add_argument("--live-minutes", type=float, default=1.0, help="length of the live run")
    words.add_argument("--seeds", type=int, default=3, help="where figures depend on luck")
    words.add_argument("--write", type=Path, metavar="PAGE", help="put the table into this Markdown page")
    rows = run(words.parse_args())
    sys.exit(1 if any(row.ok is False for row in rows) else 0)


if __name__ == "__main__":
    main()
