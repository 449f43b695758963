"""What `tools/hostile_commands.py` found: no command takes a mock-up off the table or into another.

The sequences are flown by ``make bench-full``; this reads their results.
"""

import json
from pathlib import Path

from bench.rows import ROOT, Bench, Row

SEQUENCES = ROOT / "build" / "hostile_commands.jsonl"
WANTED = 1000


def measure(bench: Bench) -> list[Row]:
    """Sequences flown, and what came of them."""
    del bench
    rows = _read(SEQUENCES)
    count = len(rows)
    if not rows:
        return [Row("hostile sequences flown", str(WANTED), "0; make bench-full flies them", ok=False)]
    left, touched = (sum(bool(row[key]) for row in rows) for key in ("left_table", "touched"))
    room_mm, apart_mm = (1e3 * min(row[key] for row in rows) for key in ("least_room_m", "least_distance_m"))
    limited = sum(row["limited"] for row in rows) / sum(row["demands"] for row in rows)
    what = f"{count} hostile sequences of 60 s"
    return [
        Row(
            f"{what}: left the table", "0 of 1000", str(left), left == 0 if count >= WANTED or left else None
        ),
        Row(
            f"{what}: touched",
            "0 of 1000",
            str(touched),
            touched == 0 if count >= WANTED or touched else None,
        ),
        Row(f"{what}: least room to the rim / between hulls", "", f"{room_mm:.0f} / {apart_mm:.0f} mm", None),
        Row(f"{what}: demands that the filter changed", "", f"{limited:.0%}", None),
    ]


def _read(path: Path) -> list[dict]:
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text().splitlines()]
