"""Rows that were there before: read, and told from what a person or a disk has made of them."""

import csv
import io
import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path

from groundstation.campaign.flying import Row, written
from groundstation.campaign.plan import HEAD, Plan, columns_of
from groundstation.files.reading import read_bytes
from groundstation.scenario.loading import Scenario
from groundstation.watch.verdict import ERROR, FAILED, PASSED

NUMBER = re.compile(r"0|[1-9][0-9]{0,6}")
"""Of a run, as rows spell it."""


def row_check(scenario: Scenario, plan: Plan) -> Callable[[Row], bool]:
    """What tells whether a row is one that a campaign has made.

    Args:
        scenario: That is flown.
        plan: How often, and from which seed.
    """
    drawn = plan.keys(scenario)
    measured = set(columns_of(scenario, plan)) - {*HEAD, *drawn}

    def is_right(row: Row) -> bool:
        run = int(row["run"])
        if run >= plan.count:
            return True  # of a longer campaign: said by who counts
        changes = {key: written(value) for key, value in plan.changes(scenario, run).items()}
        return (
            row["seed"] == str(plan.laboratory_seed(run))
            and row["verdict"] in (PASSED, FAILED, ERROR)
            and [row[key] for key in drawn] in ([changes[key] for key in drawn], [""] * len(drawn))
            and all(_is_number(row[key]) for key in measured)
        )

    return is_right


def _is_number(cell: str) -> bool:
    try:
        return not cell or not math.isnan(float(cell))
    except ValueError:
        return False


def rows_of(path: Path, columns: tuple[str, ...]) -> Iterator[Row]:
    """Whole rows of a file."""
    if not path.exists():
        return
    text = text_of(path)
    for cells in _cells(text[: text.rfind("\n") + 1]):
        if len(cells) == len(columns):
            yield dict(zip(columns, cells, strict=True))


def waiting_rows(path: Path, columns: tuple[str, ...]) -> Iterator[Row]:
    """Whole rows of a journal."""
    for line in text_of(path).splitlines() if path.exists() else ():
        try:
            row = json.loads(line)
        except (ValueError, RecursionError):
            continue  # torn: flown again
        if isinstance(row, dict) and tuple(row) == columns and all(isinstance(row[key], str) for key in row):
            yield row


def _cells(text: str) -> Iterator[list[str]]:
    try:
        yield from csv.reader(io.StringIO(text, newline=""), strict=True)
    except csv.Error:
        return  # torn in the middle of a quoted reason: what follows is flown again


def text_of(path: Path) -> str:
    """The text of a file, whatever a person or a disk has made of it."""
    return read_bytes(path).decode(errors="replace").replace("\r\n", "\n")
