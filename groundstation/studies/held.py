"""What a folder holds of a study that was run before: a report is never replaced by one that shows less."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from pathlib import Path

from groundstation.declarations.errors import UsageError
from groundstation.files.reading import read_bytes
from groundstation.studies.page import anchor_of, title_of
from groundstation.studies.study import FigureRow, Study

PAGE, RESULTS = "report.html", "results.json"


def check_held(study: Study, figures: Sequence[FigureRow], folder: Path) -> None:
    """Refuse a folder whose report would be lost; one of the same figures, or of fewer, is replaced.

    Raises:
        UsageError: It holds a report of something else, or figures that are not asked for.
    """
    page = folder / PAGE
    if not (page.exists() or (folder / RESULTS).exists()):
        return
    text = read_bytes(page).decode(errors="replace") if page.exists() else ""
    if f"<title>{escape(title_of(study))}</title>" not in text:
        raise UsageError(f"{folder}: holds results of something else than {study.name}: give another --out.")
    held = set(re.findall(r'<section id="([^"]+)">', text))
    asked = {anchor_of(row) for row in figures}
    lost = [row.label.lower() for row in study.figures if anchor_of(row) in held - asked]
    if lost:
        raise UsageError(
            f"{folder}: holds {len(lost)} more of the study ({', '.join(lost)}), and its report would be "
            "replaced by one without: give another --out."
        )
