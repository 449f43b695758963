"""The report of a recording: a page for people, and ``report.json`` for programs."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from groundstation.files.writing import check_folder, whole_folder, write_file
from groundstation.parts.table import installed_tables
from groundstation.recording.software import software
from groundstation.watch.flown_run import FlownRun, read_run
from groundstation.watch.page.page import render_page
from groundstation.watch.page.subject import Subject
from groundstation.watch.run_events import Mark, with_verdict
from groundstation.watch.verdict import Verdict

Progress = Callable[[str, float], None]


def write_report(
    recording: Path,
    folder: Path,
    progress: Progress,
    verdict: Verdict | None = None,
    compare: Path | None = None,
) -> list[Path]:
    """Read a recording and write ``report.html`` and ``report.json`` into a folder.

    Args:
        recording: Of the run.
        folder: Made if it is not there.
        progress: Takes what is being done, and the share that is done.
        verdict: On the run, where a scenario was flown.
        compare: Recording of a second run, drawn beneath the first.

    Raises:
        UsageError: A recording holds no vehicle's state.
        RecordingError: A recording cannot be read.
        FileError: The folder cannot be written.
    """
    check_folder(folder)
    tables = installed_tables()
    progress("reading the recording", 0.0)
    run = read_run(recording, tables)
    other = None
    if compare is not None:
        progress(f"reading {compare.name}", 0.2)
        other = read_run(compare, tables)
    subject = _subject(run, other, verdict)
    page = render_page(subject, lambda text, done: progress(text, 0.3 + 0.7 * done))
    folder.parent.mkdir(parents=True, exist_ok=True)
    with whole_folder(folder) as made:
        write_file(made / "report.html", page)
        write_file(made / "report.json", _numbers(subject))
    progress("done", 1.0)
    return [folder / "report.json", folder / "report.html"]


def numbers_of(
    recording: Path, progress: Progress, verdict: Verdict | None = None
) -> tuple[str, list[Mark], float]:
    """Read a recording into the text of ``report.json`` alone: nothing is drawn.

    Args:
        recording: Of the run, or its folder.
        progress: Takes what is being done, and the share that is done.
        verdict: On the run, where a scenario was flown.

    Returns:
        The text, what happened (s since the recording began), and when the run's t = 0 was.

    Raises:
        UsageError: The recording holds no vehicle's state.
        RecordingError: The recording cannot be read.
    """
    progress("reading the recording", 0.0)
    subject = _subject(read_run(recording, installed_tables()), None, verdict)
    progress("done", 1.0)
    return _numbers(subject), subject.marks, subject.zero_s


def _numbers(subject: Subject) -> str:
    return json.dumps(_plain(_summary(subject)), indent=1) + "\n"


def _subject(run: FlownRun, other: FlownRun | None, verdict: Verdict | None) -> Subject:
    """Lay the runs over each other: both count from when their last vehicle flew, where all did."""
    marks = with_verdict(run.marks, verdict)
    other_zero_s = 0.0 if other is None or math.isnan(other.aloft_s) else other.aloft_s
    if verdict is not None:
        return Subject(run, verdict.zero_s, "the scenario's time begins", marks, verdict, other, other_zero_s)
    if other is None:
        return Subject(run, 0.0, "the recording begins", marks)
    if math.isnan(run.aloft_s) or math.isnan(other.aloft_s):
        return Subject(run, 0.0, "the recordings begin", marks, None, other, 0.0)
    return Subject(run, run.aloft_s, "the last vehicle flies", marks, None, other, other_zero_s)


def _summary(subject: Subject) -> dict[str, Any]:
    run, other, verdict = subject.run, subject.other, subject.verdict
    judged = (
        {}
        if verdict is None
        else {
            "verdict": verdict.verdict,
            "reason": verdict.reason,
            "limits": [outcome.as_json() for outcome in verdict.limits],
        }
    )
    compared = {} if other is None else {"compared": _of_run(other)}
    return {
        **judged,
        **_of_run(run),
        "events": [mark.as_json(subject.zero_s) for mark in subject.marks],
        "zero_s": subject.zero_s,
        "versions": {"recorded_by": run.info.software, "reported_by": software()},
        **compared,
    }


def _of_run(run: FlownRun) -> dict[str, Any]:
    return {
        "recording": run.name,
        "sha256": run.sha256,
        "duration_s": run.duration_s,
        "vehicles": {name: run.numbers(name) for name in run.vehicles},
        "seed": run.info.seed,
        "files": dict(run.info.calibration_sha256),
    }


def _plain(value: Any) -> Any:  # noqa: ANN401 any JSON value
    """Round for people, and turn NaN into null: JSON has none."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return None if not math.isfinite(value) else round(value, 4)
    return value
