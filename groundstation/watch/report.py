"""The report of a recording: ``report.json`` and figures that people would rather look at than read."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from groundstation.declarations.errors import UsageError
from groundstation.files.writing import check_folder, whole_folder, write_file
from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.watch.figures import draw_errors, draw_fixes, draw_latency, draw_table, draw_valves
from groundstation.watch.summary import summarise, wanted
from groundstation.watch.verdict import Verdict

Progress = Callable[[str, float], None]


def write_report(
    recording: Path,
    folder: Path,
    progress: Progress,
    *,
    verdict: Verdict | None = None,
    compare: Path | None = None,
) -> list[Path]:
    """Read a recording and write figures and ``report.json`` into a folder.

    Raises:
        UsageError: The recording holds no vehicle's state.
        FileError: The folder cannot be written.
    """
    check_folder(folder)
    progress("reading the recording", 0.0)
    tables = installed_tables()
    with Recording(recording) as source:
        reports = summarise(tables, source.delivered(wanted(tables)), source.start_ns)
        duration_s = (source.stop_ns - source.start_ns) * 1e-9
    if not reports:
        raise UsageError(f"{recording}: holds no vehicle state, so there is nothing to report")
    folder.parent.mkdir(parents=True, exist_ok=True)
    del compare
    tracks = {name: report.track for name, report in reports.items()}
    figures = {
        "table.png": draw_table,
        "errors.png": draw_errors,
        "valves.png": draw_valves,
        "fixes.png": draw_fixes,
        "latency.png": draw_latency,
    }
    summary = {
        "recording": recording.name,
        "duration_s": duration_s,
        "vehicles": {name: report.numbers for name, report in reports.items()},
    }
    if verdict is not None:
        summary |= {"verdict": verdict.verdict, "reason": verdict.reason}
    with whole_folder(folder) as made:
        for done, (name, draw) in enumerate(figures.items(), start=1):
            progress(f"drawing {name}", done / (len(figures) + 1))
            draw(tracks, made / name)
        write_file(made / "report.json", json.dumps(_plain(summary), indent=1) + "\n")
    progress("done", 1.0)
    return [folder / name for name in ("report.json", *figures)]


def _plain(value: Any) -> Any:  # noqa: ANN401 any JSON value
    """Round for people, and turn NaN into null: JSON has none."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return None if not math.isfinite(value) else round(value, 4)
    return value
