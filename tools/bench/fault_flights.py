"""What `tools/fault_campaign.py` found: every failure over seeds, and hours of healthy flight.

The flights are flown by ``make bench-full``, which takes an hour; this reads its results.
"""

import json
from pathlib import Path

import numpy as np

from bench.rows import ROOT, Bench, Row

FLIGHTS, HEALTHY = ROOT / "build" / "fault_campaign.jsonl", ROOT / "build" / "healthy_flights.jsonl"
PROMISES = ("left_table", "hit_neighbour", "floated_unarmed", "open_when_disarmed")
BY_ON_TIME = {"stuck_closed_valve": 0.2}
THRUST_S = 2.0
BY_THRUST = {"stuck_open_valve": 1.0, "pulsing_valve": 0.06 / 0.4, "leaking_valve": 0.4}
"""Share of a valve's thrust that is not commanded, with the parameters of the campaign."""
HOURS = 10.0
"""Of healthy flight, without which their promise is not shown."""
WITHOUT_A_LIMIT = {"weak_valve", "slow_camera", "healthy"}


def measure(bench: Bench) -> list[Row]:
    """A row per promise of the whole, and one per failure."""
    del bench
    rows = [row for row in _read(FLIGHTS) if row["failure"] != "healthy"]
    found = []
    for promise in PROMISES:
        broken = sum(bool(row[promise]) for row in rows)
        what = f"{len(rows)} flights with a failure: {promise.replace('_', ' ')}"
        found.append(_never(what, "0", broken, is_enough=bool(rows)))
    names = sorted({str(row["failure"]) for row in rows})
    found += [_of_failure(name, [row for row in rows if row["failure"] == name]) for name in names]
    healthy = _read(HEALTHY)
    hours = sum(float(row["start_s"]) + 600.0 for row in healthy) / 3600.0
    alarms = sum(len(row["false_alarms"]) + len(row["others"]) for row in healthy)
    what = f"false alarms in {hours:.1f} h of healthy flight"
    found.append(_never(what, f"0 in {HOURS:g} h", alarms, is_enough=hours >= HOURS))
    return found


def _never(what: str, limit: str, times: int, *, is_enough: bool) -> Row:
    """What must not happen: once is too often, and never in too few flights shows nothing."""
    shown = str(times) if times or is_enough else f"{times}, too little was flown"
    return Row(what, limit, shown, False if times else True if is_enough else None)


def _of_failure(name: str, rows: list[dict]) -> Row:
    seen = [row for row in rows if row["fault"]]
    times = np.array([row["found_after_s"] for row in seen])
    worst = max(row["excursion_m"] for row in rows)
    within = np.quantile(times, 0.95) if len(times) else float("nan")
    told = f"{len(seen)} of {len(rows)}; 95 % within {within:.2f} s, median {np.median(times):.2f} s"
    if name in BY_ON_TIME:
        on_time_s = np.quantile([row["commanded_s"] for row in seen], 0.95)
        told += f", {on_time_s:.2f} s of on-time"
        held, must = bool(on_time_s <= BY_ON_TIME[name]), "0.2 s of on-time"
    elif name in WITHOUT_A_LIMIT:
        held, must = None, ""
    else:
        limit_s = THRUST_S / BY_THRUST[name] if name in BY_THRUST else 1.0
        share = np.mean([bool(row["fault"]) and row["found_after_s"] <= limit_s for row in rows])
        must = f"95 % within {limit_s:.3g} s" + (f", {THRUST_S:g} s of thrust" if name in BY_THRUST else "")
        held = bool(share >= 0.95)
    return Row(f"{name}: found; farthest from where it was", must, f"{told}; {worst:.2f} m", held)


def _read(path: Path) -> list[dict]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines()]
