"""What formation flight has to reach, flown over many seeds in virtual time: scenarios and their dispersions.

    python tools/formation_flights.py --seeds 100 --out build/formation_flights.jsonl
    python tools/formation_flights.py --only go_to swap --seeds 3

Run k of a subject is the same on any machine and with any number of jobs. Results are appended to a file, one
JSON object per flight; those that are there are left out, so that it goes on where it was ended.
`tools/bench.py --only flying_formation` reads them.
"""

import argparse
import json
import sys
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from types import MappingProxyType

from commander_silence import silence

from groundstation.campaign.flying import Package, fly_run, packed
from groundstation.campaign.plan import HEAD, Plan
from groundstation.scenario.loading import load

ROOT = Path(__file__).parents[1]
EXAMPLES, OWN = ROOT / "examples" / "scenarios", ROOT / "tools" / "formation"
FEW = 20
"""Seeds of the subjects for which no more are asked for."""
CAMPAIGN_SEED = 1


@dataclass(frozen=True, slots=True)
class Subject:
    """What is flown.

    Attributes:
        fly: Flies a run: its verdict, why, and its figures by name.
        most_seeds: More are not flown.
    """

    fly: Callable[[int], tuple[str, str, dict[str, float]]]
    most_seeds: int = 1_000_000


@cache
def _package(path: Path) -> Package:
    return packed(load(path), Plan(1, CAMPAIGN_SEED), str(path))


def _scenario(path: Path, run: int) -> tuple[str, str, dict[str, float]]:
    row = fly_run(_package(path), run)
    figures = {name: float(text) for name, text in row.items() if name not in HEAD and _is_number(text)}
    return row["verdict"], row["reason"], figures


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _silence(run: int) -> tuple[str, str, dict[str, float]]:
    silent_s = silence(run)
    return ("passed", "", {"silent_s": silent_s}) if silent_s < 60.0 else ("failed", "nobody braked", {})


SUBJECTS: Mapping[str, Subject] = MappingProxyType(
    {
        "station_keeping": Subject(partial(_scenario, OWN / "station_keeping.toml")),
        "perimeter": Subject(partial(_scenario, EXAMPLES / "perimeter.toml")),
        "least_gas": Subject(partial(_scenario, OWN / "least_gas.toml")),
        "go_to": Subject(partial(_scenario, EXAMPLES / "go_to_uphill.toml")),
        "stuck_closed": Subject(partial(_scenario, OWN / "stuck_closed.toml"), FEW),
        "stuck_open": Subject(partial(_scenario, OWN / "stuck_open.toml"), FEW),
        "dock_still": Subject(partial(_scenario, EXAMPLES / "dock_still.toml")),
        "dock_turning": Subject(partial(_scenario, EXAMPLES / "dock_turning.toml")),
        "swap": Subject(partial(_scenario, EXAMPLES / "five_ship_swap.toml")),
        "silence": Subject(_silence),
    }
)
"""THE TABLE, in the order of the page."""


def flight(name: str, run: int) -> dict[str, object]:
    """Fly a run of a subject; the row that is kept of it."""
    began_s = time.process_time()
    verdict, reason, figures = SUBJECTS[name].fly(run)
    return {
        "subject": name,
        "run": run,
        "verdict": verdict,
        "reason": reason,
        "cpu_s": round(time.process_time() - began_s, 3),
        "figures": figures,
    }


def main() -> int:
    """Fly what is missing; 1 if a flight ended with an error."""
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--seeds", type=int, default=3, help="runs of each subject")
    words.add_argument("--only", nargs="+", choices=list(SUBJECTS), help="these subjects only")
    words.add_argument("--out", type=Path, default=ROOT / "build" / "formation_flights.jsonl")
    words.add_argument("--jobs", type=int, default=2)
    given = words.parse_args()
    given.out.parent.mkdir(parents=True, exist_ok=True)
    done = [json.loads(line) for line in given.out.read_text().splitlines()] if given.out.exists() else []
    known = {(row["subject"], row["run"]) for row in done}
    names = given.only or list(SUBJECTS)
    missing = [
        (name, run)
        for name in names
        for run in range(min(given.seeds, SUBJECTS[name].most_seeds))
        if (name, run) not in known
    ]
    with ProcessPoolExecutor(given.jobs) as pool, given.out.open("a") as file:
        for number, row in enumerate(pool.map(flight, *zip(*missing, strict=True)) if missing else (), 1):
            done.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
            sys.stderr.write(f"\r{number} of {len(missing)} flights ")
    sys.stderr.write("\n")
    return report([row for row in done if row["subject"] in names])


def report(rows: list[dict]) -> int:
    """Print what was found; 1 if a flight ended with an error."""
    for name in dict.fromkeys(row["subject"] for row in rows):
        flown = [row for row in rows if row["subject"] == name]
        passed = sum(row["verdict"] == "passed" for row in flown)
        cpu_s = sum(row["cpu_s"] for row in flown) / len(flown)
        print(f"{name}: {passed} of {len(flown)} passed, {cpu_s:.1f} s of CPU each")
        for row in flown:
            if row["verdict"] != "passed":
                print(f"  run {row['run']}: {row['verdict']}: {row['reason']}")
    return int(any(row["verdict"] == "error" for row in rows))


if __name__ == "__main__":
    sys.exit(main())
