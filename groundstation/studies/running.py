"""A study run: its flights flown once for each side, its figures drawn, the page and the numbers written."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from groundstation.files.writing import check_folder, write_files
from groundstation.studies.flown import Flown, fly_flight
from groundstation.studies.page import render_page
from groundstation.studies.study import Drawn, FigureRow, Study

Progress = Callable[[str, float], None]
FLIGHTS = "flights"


def reproduce(study: Study, figures: Sequence[FigureRow], folder: Path, progress: Progress) -> list[Path]:
    """Fly what the figures need, draw them, write ``report.html`` and ``results.json``.

    Args:
        study: To be run again.
        figures: Of it, all or some.
        folder: Where to write; recordings of the flights go to its folder ``flights``.
        progress: Takes what is going on and the share that is done.

    Returns:
        The files written, the page first.

    Raises:
        UsageError: A file is wrong, or cannot be written.
        GroundStationError: A recording cannot be written any further.
    """
    check_folder(folder)
    recordings = folder / FLIGHTS
    names = [name for name in study.flights if any(name in row.flights for row in figures)]
    if names:
        recordings.mkdir(parents=True, exist_ok=True)
    count = sum(len(study.flights[name].rigs) for name in names)
    flown: dict[str, dict[str, Flown]] = {}
    done = 0
    for name in names:
        row = study.flights[name]
        flown[name] = {}
        for side, rig in row.rigs.items():
            what, begun = f"flying {name}, {side} methods", done / (count + 1)

            def report(text: str, _: float, what: str = what, begun: float = begun) -> None:
                progress(f"{what}: {text}", begun)

            flown[name][side] = fly_flight(row.scenario, rig, recordings / f"{name}_{side}.mcap", report)
            done += 1
    drawn: list[tuple[FigureRow, Drawn]] = []
    for figure in figures:
        progress(f"drawing {figure.label.lower()}", (count + len(drawn) / len(figures)) / (count + 1))
        drawn.append((figure, figure.draw({name: flown[name] for name in figure.flights})))
    page, results = folder / "report.html", folder / "results.json"
    write_files(
        {
            page: render_page(study, drawn),
            results: json.dumps(results_of(drawn), indent=1, ensure_ascii=False),
        }
    )
    return [page, results]


def results_of(drawn: Sequence[tuple[FigureRow, Drawn]]) -> list[dict[str, Any]]:
    """Return a row per number, as results.json holds them; null where nothing is stated."""
    return [
        {
            row.kind: ", ".join(map(str, row.numbers)),
            "quantity": number.quantity,
            "published": _plain(number.published),
            "ours": _plain(number.ours),
            "default": _plain(number.default),
            "assumed": " ".join((number.assumed, *row.assumed)).strip(),
            "comes_out": number.comes_out,
            "put_in": number.is_put_in,
        }
        for row, found in drawn
        for number in found.numbers
    ]


def _plain(value: float) -> float | None:
    return round(value, 6) if math.isfinite(value) else None
