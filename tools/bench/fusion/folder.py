"""Recorded data sets with truth, judged as the generated ones are."""

from bench.fusion.accuracy import LIMITS, accuracy_rows, coverage_rows, wrong_fix_rows
from bench.fusion.score import flown
from bench.limits import plain
from bench.rows import Bench, Row
from groundstation.fusion.error_state_filter import ErrorStateFilter

HAS_MANY_WRONG = 0.05
"""Share of wrong fixes from which the accuracy among them is what counts."""


def measure(bench: Bench) -> list[Row]:
    """Every folder below the one named; limits are those of the scenario that its name begins with."""
    assert bench.data is not None, "tools/bench.py asks for it"
    rows: list[Row] = []
    for folder in sorted(
        path.parent for path in bench.data.rglob("truth.csv") if (path.parent / "imu.csv").exists()
    ):
        bench.say(f"fusion: {folder.name}")
        figures = [flown(folder, ErrorStateFilter)]
        fixes = sum(1 for _ in (folder / "stars.csv").open()) - 1
        if figures[0].wrong > HAS_MANY_WRONG * fixes:
            rows += wrong_fix_rows(figures, folder.name)
        else:
            rows += accuracy_rows(folder.name, figures, LIMITS.get(folder.name.split("_")[0]))
        if figures[0].outage_end_mm == figures[0].outage_end_mm:
            rows.append(
                plain(f"{folder.name}: error at the end of the outage", figures[0].outage_end_mm, "mm")
            )
        rows += coverage_rows(folder.name, figures)
    return rows
