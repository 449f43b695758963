"""The tables of a page as HTML."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from groundstation.watch.flown_run import FlownRun
from groundstation.watch.page.subject import Drawn, Subject
from groundstation.watch.verdict import LimitOutcome, Verdict

Cell = str
NUMBERS: Mapping[str, str] = {
    "flying_since_s": "flying since, s",
    "settled_for_s": "judged for, s",
    "station_position_rms_mm": "off the setpoint, RMS, mm",
    "station_position_max_mm": "off the setpoint, largest, mm",
    "station_heading_rms_deg": "off the setpoint, heading RMS, deg",
    "estimate_position_rms_mm": "estimate by truth, RMS, mm",
    "estimate_heading_rms_deg": "estimate by truth, heading RMS, deg",
    "gas_ns": "gas, N s",
    "closures": "times the gate closed",
    "time_without_state_s": "without a state in the air, s",
    "imu_frames": "IMU frames",
    "imu_frames_lost": "IMU frames lost",
    "fix_innovation_position_rms_mm": "innovation of used fixes, RMS, mm",
    "fix_innovation_heading_rms_deg": "innovation of used fixes, heading RMS, deg",
    "fix_nis_mean": "mean NIS of used fixes (3 expected)",
}
"""Key of report.json and the words for it, in the order of the table; other plain numbers come behind."""


def table(head: Sequence[str], rows: Iterable[Sequence[Cell]], kind: str = "") -> str:
    """A table; cells are HTML, the first of each row is its heading."""
    named = f' class="{kind}"' if kind else ""
    heads = "".join(f"<th>{escape(each)}</th>" for each in head)
    body = "".join(
        f"<tr><th>{row[0]}</th>{''.join(f'<td>{each}</td>' for each in row[1:])}</tr>" for row in rows
    )
    return f"<table{named}><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>\n"


def limits(verdict: Verdict) -> str:
    """What had to hold, and whether it did."""
    head = ("what", "vehicle", "value", "limit", "", "at, s")
    return table(head, map(_limit, verdict.limits), "limits")


def _limit(outcome: LimitOutcome) -> list[Cell]:
    bounds = [f"above {figure(outcome.above)}"] if outcome.above is not None else []
    bounds += [f"below {figure(outcome.below)}"] if outcome.below is not None else []
    held = '<span class="good">held</span>' if outcome.held else '<span class="bad">failed</span>'
    whose = escape(", ".join(outcome.vehicles)) or "all"
    words = escape(" and ".join(bounds))
    value = "never" if math.isinf(outcome.value) else figure(outcome.value)
    return [escape(outcome.what), whose, value, words, held, figure(outcome.at_s)]


def numbers(subject: Subject) -> str:
    """Numbers of each vehicle; those of a second run beside them."""
    columns = [
        (drawn, drawn.run.numbers(drawn.name)) for name in subject.names for drawn in _in_order(subject, name)
    ]
    keys = list(NUMBERS)
    for _, values in columns:
        keys += [key for key, value in values.items() if key not in keys and isinstance(value, int | float)]
    rows = [
        [escape(NUMBERS.get(key, key.replace("_", " "))), *(figure(values.get(key)) for _, values in columns)]
        for key in keys
        if any(values.get(key) is not None for _, values in columns)
    ]
    landed = [escape(str(values.get("landed_by_fault") or "\u2013")) for _, values in columns]
    return table(
        ["", *(drawn.words for drawn, _ in columns)], [*rows, ["landed by a fault", *landed]], "numbers"
    )


def fixes(subject: Subject) -> str:
    """What became of the fixes of each vehicle and source."""
    rows = []
    for drawn in (each for name in subject.names for each in _in_order(subject, name)):
        track = drawn.track
        counts: dict[str, Counter[str]] = {}
        outcomes = zip(track.account_sources, track.account_reasons, track.accounts[:, 1], strict=True)
        for source, reason, used in outcomes:
            counts.setdefault(source, Counter())["used" if used else reason or "not used"] += 1
        for source, found in counts.items():
            refused = ", ".join(
                f"{count} {reason}" for reason, count in found.most_common() if reason != "used"
            )
            used, total = found["used"], sum(found.values())
            share = f"{100.0 * used / total:.1f} %"
            rows.append([escape(drawn.words), escape(source), str(used), share, escape(refused) or "none"])
    return table(["vehicle", "source", "used", "share", "not used"], rows, "fixes") if rows else ""


def latency(subject: Subject) -> str:
    """Median and 99th percentile of the ages at each stage."""
    columns = [
        (drawn, found) for name in subject.names for drawn in _in_order(subject, name)
        if (found := drawn.track.latency) is not None
    ]  # fmt: skip
    if not columns:
        return ""
    stages = columns[0][1].stages
    rows = []
    for stage in stages:
        cells = []
        for _, found in columns:
            low, high = (
                dict(zip(found.stages, ages, strict=True)).get(stage, math.nan)
                for ages in (found.p50_s, found.p99_s)
            )
            cells.append(f"{figure(1e3 * low)} / {figure(1e3 * high)}" if math.isfinite(low) else "\u2013")
        rows.append([escape(stage.replace("_", " ")), *cells])
    return table(["age, ms: median / 99 %", *(drawn.words for drawn, _ in columns)], rows)


def events(subject: Subject) -> str:
    """What the numbers in the pictures mean."""
    rows = [
        [
            f'<span class="number {mark.kind}">{index}</span>',
            f"{mark.t_s:.2f}",
            "" if mark.until_s is None else f"{mark.until_s - mark.t_s:.2f}",
            escape(mark.vehicle or "all"),
            escape(mark.kind),
            escape(mark.text),
        ]
        for index, mark in subject.numbered()
    ]
    return table(["", "t, s", "for, s", "vehicle", "what", ""], rows, "events") if rows else "<p>Nothing.</p>"


def provenance(run: FlownRun) -> str:
    """What the run was made with."""
    info = run.info
    rows: list[list[Cell]] = [
        ["recording", f"{escape(run.name)}, {run.duration_s:.1f} s"],
        ["SHA-256", f"<code>{run.sha256}</code>"],
        ["rig", escape(f"{run.rig.name} ({info.rig_path})" if info.rig_path else run.rig.name)],
        ["recorded by", escape(info.software)],
        ["seed of the emulated laboratory", "\u2013" if info.seed is None else str(info.seed)],
        ["clock", "virtual" if info.utc_offset_ns is None else "monotonic"],
    ]
    rows += [
        [f"file {escape(name)}", f"<code>{escape(sha)}</code>"]
        for name, sha in info.calibration_sha256.items()
    ]
    rows += [["missing", escape(sentence)] for sentence in run.missing]
    return table(["", escape(run.name)], rows, "provenance")


def figure(value: Any) -> str:  # noqa: ANN401 a number of any kind
    """A number for people: four digits."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "\u2013"
    if isinstance(value, bool) or not isinstance(value, int | float):
        return escape(str(value))
    if isinstance(value, int):
        return str(value)
    return f"{value:.4g}" if abs(value) < 1e4 or math.isinf(value) else f"{value:.0f}"


def _in_order(subject: Subject, name: str) -> list[Drawn]:
    """The run first."""
    return list(subject.drawn(name))[::-1]
