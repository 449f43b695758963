"""Measure what the limits of the project speak of, print the tables, say what is missed.

    make bench
    python tools/bench.py --only star fusion
    python tools/bench.py --only house --before ../commit_before
    python tools/bench.py --only star_lights --trials 3750
    python tools/bench.py --only star_folder --folder recordings/ceiling
    python tools/bench.py --fresh-clone --live-minutes 10 --write docs/benchmarks.md

Exit code 1 if a limit is missed. Close other programs: on a busy machine a live run measures them.
--write replaces the tables of the subjects of this run and leaves the others as they are.
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

import cv2  # noqa: E402
from bench import (  # noqa: E402
    campaign,
    console,
    crowd,
    deaths,
    fault_flights,
    flying_formation,
    fresh_clone,
    hostile_commands,
    house,
    laboratory_fit,
    live,
    live_faults,
    lockstep_speed,
    many_mock_ups,
    memory,
    outage,
    overhead,
    parser,
    published,
    recorder,
    report,
    side_camera,
    station_keeping,
    stop,
)
from bench import table as bench_table  # noqa: E402
from bench.fusion import accuracy as fusion_accuracy  # noqa: E402
from bench.fusion import folder as fusion_folder  # noqa: E402
from bench.fusion import peers as fusion_peers  # noqa: E402
from bench.fusion import speed as fusion_speed  # noqa: E402
from bench.relative import accuracy as relative_accuracy  # noqa: E402
from bench.relative import images as relative_images  # noqa: E402
from bench.relative import peers as relative_peers  # noqa: E402
from bench.rows import Bench, Measure, Row  # noqa: E402
from bench.star import bound as star_bound  # noqa: E402
from bench.star import damage as star_damage  # noqa: E402
from bench.star import few as star_few  # noqa: E402
from bench.star import folder as star_folder  # noqa: E402
from bench.star import frames as star_frames  # noqa: E402
from bench.star import lights as star_lights  # noqa: E402
from bench.star import peers as star_peers  # noqa: E402
from bench.star import sky as star_sky  # noqa: E402
from bench.unit import reference_unit_s  # noqa: E402
from rich.console import Console  # noqa: E402

MEASURES: Mapping[str, Measure] = MappingProxyType(
    {
        "live": live.measure,
        "stop": stop.measure,
        "console": console.measure,
        "campaign": campaign.measure,
        "deaths": deaths.measure,
        "live_faults": live_faults.measure,
        "outage": outage.measure,
        "crowd": crowd.measure,
        "fault_flights": fault_flights.measure,
        "hostile_commands": hostile_commands.measure,
        "flying_formation": flying_formation.measure,
        "house": house.measure,
        "memory": memory.measure,
        "station_keeping": station_keeping.measure,
        "lockstep": lockstep_speed.measure,
        "parser": parser.measure,
        "report": report.measure,
        "recorder": recorder.measure,
        "many_mock_ups": many_mock_ups.measure,
        "star": star_frames.measure,
        "star_bound": star_bound.measure,
        "star_few": star_few.measure,
        "star_lights": star_lights.measure,
        "star_damage": star_damage.measure,
        "star_sky": star_sky.measure,
        "star_peers": star_peers.measure,
        "published": published.measure,
        "star_folder": star_folder.measure,
        "overhead": overhead.measure,
        "laboratory_fit": laboratory_fit.measure,
        "fusion": fusion_accuracy.measure,
        "fusion_speed": fusion_speed.measure,
        "fusion_peers": fusion_peers.measure,
        "fusion_folder": fusion_folder.measure,
        "relative": relative_accuracy.measure,
        "relative_images": relative_images.measure,
        "relative_peers": relative_peers.measure,
        "side_camera": side_camera.measure,
        "fresh_clone": fresh_clone.measure,
    }
)
"""THE TABLE of subjects, in the order of the page."""
FOLDERS = {"star_folder": "ceiling.csv", "fusion_folder": "**/imu.csv"}
"""Subjects of recorded data, and what their folder must hold."""
ON_REQUEST = frozenset(
    {
        "campaign",
        "crowd",
        "fresh_clone",
        "fault_flights",
        "hostile_commands",
        "flying_formation",
        "laboratory_fit",
        "live_faults",
        "memory",
        "deaths",
        *FOLDERS,
    }
)


def run(arguments: argparse.Namespace) -> list[Row]:
    """Measure what was asked for, subject by subject; each is written as soon as it is there."""
    names = arguments.only or [name for name in MEASURES if name not in ON_REQUEST]
    if arguments.fresh_clone and "fresh_clone" not in names:
        names = [*names, "fresh_clone"]
    console = Console(stderr=True)
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="bench_") as folder:
        for name in names:
            with console.status(name) as status:
                bench = Bench(
                    folder=Path(folder),
                    live_minutes=arguments.live_minutes,
                    seeds=arguments.seeds,
                    frames=arguments.frames,
                    trials=arguments.trials,
                    data=arguments.folder,
                    before=arguments.before,
                    unit_s=reference_unit_s(),
                    say=status.update,
                )
                found = MEASURES[name](bench)
            reported = f"{bench_table.machine()}; {bench.circumstances()}."
            print(f"\n{name}: {reported}\n{bench_table.text(found)}", flush=True)
            if arguments.write is not None:
                bench_table.write(
                    arguments.write, {name: bench_table.section(reported, found)}, list(MEASURES)
                )
            rows += found
    return rows


def main() -> None:
    """Parse the words and run."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--only", nargs="+", choices=list(MEASURES), help="these subjects only")
    words.add_argument("--fresh-clone", action="store_true", help="also clone, install and fly (minutes)")
    words.add_argument("--live-minutes", type=float, default=1.0, help="length of the live run")
    words.add_argument("--seeds", type=int, default=6, help="flights per scenario, of loop and fusion")
    words.add_argument("--frames", type=int, default=200, help="star pictures per kind")
    words.add_argument(
        "--trials", type=int, default=400, help="pictures per number of random lights, of eight"
    )
    words.add_argument("--folder", type=Path, help="data with truth, for star_folder and fusion_folder")
    words.add_argument("--before", type=Path, help="checkout of an earlier commit with its .venv, for house")
    words.add_argument("--write", type=Path, metavar="PAGE", help="put the tables into this Markdown page")
    arguments = words.parse_args()
    for name, pattern in FOLDERS.items():
        if name in (arguments.only or ()) and not (arguments.folder and any(arguments.folder.glob(pattern))):
            words.error(f"{name} needs --folder with a data set: truth.csv beside {Path(pattern).name}")
    cv2.setNumThreads(1)
    rows = run(arguments)
    sys.exit(1 if any(row.ok is False for row in rows) else 0)


if __name__ == "__main__":
    main()
