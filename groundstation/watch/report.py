"""The report of a recording: ``report.json`` and figures that people would rather look at than read."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.messages import definitions as m
from groundstation.recording.reader import Recording
from groundstation.runtime.errors import UsageError
from groundstation.runtime.figures import draw_errors, draw_fixes, draw_latency, draw_table, draw_valves
from groundstation.runtime.tracks import Track, estimate_errors, read_tracks, station_errors

SETTLING_S = 20.0
"""Left out of the station-keeping figures after the vehicle began to fly."""

Progress = Callable[[str, float], None]
Array = NDArray[np.float64]


def write_report(recording: Path, folder: Path, progress: Progress) -> list[Path]:
    """Read a recording and write figures and ``report.json`` into a folder.

    Raises:
        UsageError: The recording holds no vehicle's state.
    """
    progress("reading the recording", 0.0)
    with Recording(recording) as source:
        tracks = read_tracks(source)
        duration_s = (source.stop_ns - source.start_ns) * 1e-9
    if not tracks:
        raise UsageError(f"{recording}: holds no vehicle state, so there is nothing to report")
    folder.mkdir(parents=True, exist_ok=True)
    figures = {
        "table.png": draw_table,
        "errors.png": draw_errors,
        "valves.png": draw_valves,
        "fixes.png": draw_fixes,
        "latency.png": draw_latency,
    }
    written = []
    for done, (name, draw) in enumerate(figures.items(), start=1):
        progress(f"drawing {name}", done / (len(figures) + 1))
        draw(tracks, folder / name)
        written.append(folder / name)
    summary = {
        "recording": recording.name,
        "duration_s": duration_s,
        "vehicles": {name: summarise(track) for name, track in tracks.items()},
    }
    path = folder / "report.json"
    path.write_text(json.dumps(_plain(summary), indent=1) + "\n")
    progress("done", 1.0)
    return [path, *written]


def summarise(track: Track) -> dict[str, Any]:
    """The numbers of one vehicle."""
    station, estimate = station_errors(track), estimate_errors(track)
    settled = station[station[:, 0] >= track.flying_since_s + SETTLING_S]
    flown = estimate[estimate[:, 0] >= track.flying_since_s + SETTLING_S]
    latency = track.latency
    used = track.accounts[(track.accounts[:, 1] == 1.0) & np.isfinite(track.accounts[:, 5])]
    return {
        "flying_since_s": track.flying_since_s,
        "settled_for_s": float(np.ptp(settled[:, 0])) if len(settled) else 0.0,
        "station_position_rms_mm": _rms(settled[:, 1]) * 1e3,
        "station_position_max_mm": float(settled[:, 1].max() * 1e3) if len(settled) else math.nan,
        "station_heading_rms_deg": math.degrees(_rms(settled[:, 2])),
        "estimate_position_rms_mm": _rms(np.hypot(flown[:, 1], flown[:, 2])) * 1e3,
        "estimate_heading_rms_deg": math.degrees(_rms(flown[:, 3])),
        "imu_frames": track.imu_frames,
        "imu_frames_lost": track.frames_lost,
        "fixes": track.fixes,
        "fix_innovation_position_rms_mm": _rms(np.hypot(used[:, 2], used[:, 3])) * 1e3,
        "fix_innovation_heading_rms_deg": math.degrees(_rms(used[:, 4])),
        "fix_nis_mean": float(used[:, 5].mean()) if len(used) else math.nan,
        **({"star_against_overhead": compared(track.comparisons)} if track.comparisons else {}),
        "latency_p50_ms": {} if latency is None else _stages(latency, latency.p50_s),
        "latency_p99_ms": {} if latency is None else _stages(latency, latency.p99_s),
    }


def compared(pairs: list[m.FixComparison]) -> dict[str, Any]:
    """Star fixes against overhead fixes over a whole recording, and the last verdict of the referee."""
    differences = np.array([pair.difference for pair in pairs])
    mean, rms = differences.mean(axis=0), np.sqrt((differences**2).mean(axis=0))
    return {
        "pairs": len(pairs),
        "mean_mm_mm_deg": [*(mean[:2] * 1e3).tolist(), math.degrees(mean[2])],
        "rms_mm_mm_deg": [*(rms[:2] * 1e3).tolist(), math.degrees(rms[2])],
        "nis_over_3": float(np.mean([pair.nis for pair in pairs])) / 3.0,
        "disagreed_ratio": float(np.mean([pair.verdict == "disagree" for pair in pairs])),
        "last_verdict": pairs[-1].verdict,
        "reason": pairs[-1].reason,
    }


def _stages(latency: m.Latency, ages_s: tuple[float, ...]) -> dict[str, float]:
    return {stage: age * 1e3 for stage, age in zip(latency.stages, ages_s, strict=True)}


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan


def _plain(value: Any) -> Any:  # noqa: ANN401 any JSON value
    """Round for people, and turn NaN into null: JSON has none."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return None if not math.isfinite(value) else round(value, 4)
    return value
