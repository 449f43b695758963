"""A study run: its data made, its figures drawn, the page and the numbers written."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from groundstation.files.writing import check_folder, write_files
from groundstation.studies.held import PAGE, RESULTS, check_held
from groundstation.studies.page import render_page
from groundstation.studies.study import Drawn, FigureRow, Progress, Study


class StudyInterrupted(KeyboardInterrupt):
    """Ctrl-C while a study was run; the message is a sentence on what is finished and what is not."""


def reproduce(study: Study, figures: Sequence[FigureRow], folder: Path, progress: Progress) -> list[Path]:
    """Make what the figures need, draw them, write ``report.html`` and ``results.json``.

    Args:
        study: To be run again.
        figures: Of it, all or some.
        folder: Where to write; sources may leave there what they made, flights their recordings.
        progress: Takes what is going on and the share that is done.

    Returns:
        The files written, the page first.

    Raises:
        UsageError: A file is wrong, or cannot be written, or the folder holds more than is asked for.
        GroundStationError: A recording cannot be written any further.
        StudyInterrupted: Ctrl-C came.
    """
    check_folder(folder)
    check_held(study, figures, folder)
    new = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    before = _files_in(folder)
    doing = ["beginning"]

    def noted(text: str, share: float) -> None:
        doing[0] = text
        progress(text, share)

    try:
        return _reproduced(study, figures, folder, noted)
    except KeyboardInterrupt as stop:
        finished = [name for name, stamp in _files_in(folder).items() if before.get(name) != stamp]
        if not finished:
            _remove_empty(new)
        raise StudyInterrupted(_stopped(folder, doing[0], finished)) from stop


def _remove_empty(folders: Sequence[Path]) -> None:
    """Take away the folders that were made for nothing, the innermost first."""
    for folder in folders:
        try:
            folder.rmdir()
        except OSError:  # something is in it
            return


def _files_in(folder: Path) -> dict[str, int]:
    """When each file was written, ns, by its name in the folder."""
    found = sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {str(path.relative_to(folder)): path.stat().st_mtime_ns for path in found}


def _stopped(folder: Path, doing: str, finished: Sequence[str]) -> str:
    made = f"finished in {folder}: {', '.join(finished)}" if finished else f"nothing was finished in {folder}"
    if {PAGE, RESULTS} <= set(finished):
        return f"interrupted at the end: {made}."
    old = "; those that are there are of an earlier run" if (folder / PAGE).exists() else ""
    return f"interrupted while {doing}: {made}; {PAGE} and {RESULTS} were not written{old}."


def _reproduced(study: Study, figures: Sequence[FigureRow], folder: Path, progress: Progress) -> list[Path]:
    names = [name for name in study.sources if any(name in row.needs for row in figures)]
    whole = 1.0 + sum(study.sources[name].size for name in names)
    made: dict[str, Any] = {}
    done = 0.0
    for name in names:
        size = study.sources[name].size

        def report(text: str, share: float, begun: float = done, size: float = size) -> None:
            progress(text, (begun + share * size) / whole)

        made[name] = study.sources[name].make(name, folder, report)
        done += size
    drawn: list[tuple[FigureRow, Drawn]] = []
    for figure in figures:
        progress(f"drawing {figure.label.lower()}", (done + len(drawn) / len(figures)) / whole)
        drawn.append((figure, figure.draw({name: made[name] for name in figure.needs})))
    page, results = folder / PAGE, folder / RESULTS
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
    return float(f"{value:.6g}") if math.isfinite(value) else None
