"""Figures of the report. Each takes the tracks and a path, and leaves a PNG."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from groundstation.parts.control.gauges import station_errors
from groundstation.parts.operation.messages import Latency
from groundstation.parts.reference.gauges import estimate_errors
from groundstation.watch.tracks import Track

VALVES = 8
DPI = 120
_COLOURS = ("#2a6fbb", "#c8553d", "#3c8d5a", "#8a5fbf", "#b8860b", "#4d4d4d")


def draw_table(tracks: Mapping[str, Track], path: Path) -> None:
    """Top view: truth as a trail, goal as a cross, the mock-up at the end with its heading."""
    figure = Figure(figsize=(8, 6), layout="constrained")
    axes = figure.add_subplot()
    for colour, (name, track) in zip(_cycle(), tracks.items(), strict=False):
        path_xy = track.truth if len(track.truth) else track.state
        axes.plot(path_xy[:, 1], path_xy[:, 2], color=colour, lw=1, alpha=0.8, label=name)
        x, y, heading = path_xy[-1, 1:4]
        half = 0.15
        corners = np.array([[-half, -half], [half, -half], [half, half], [-half, half], [-half, -half]])
        turn = np.array([[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]])
        outline = corners @ turn.T + (x, y)
        axes.plot(outline[:, 0], outline[:, 1], color=colour, lw=2)
        axes.plot([x, x + 0.2 * math.cos(heading)], [y, y + 0.2 * math.sin(heading)], color=colour, lw=2)
        if len(track.goal):
            axes.plot(track.goal[-1, 1], track.goal[-1, 2], "+", color="black", ms=12)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, m")
    axes.set_ylabel("y, m")
    axes.set_title("On the table: path of the truth, goals (+), mock-ups at the end")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.savefig(path, dpi=DPI)


def draw_errors(tracks: Mapping[str, Track], path: Path) -> None:
    """Off the goal, and estimate against truth with its three-sigma band, over time."""
    figure = Figure(figsize=(10, 3 * 4), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True)
    for colour, (name, track) in zip(_cycle(), tracks.items(), strict=False):
        station = station_errors(track.truth, track.goal, track.flying_since_s)
        estimate = estimate_errors(track.state, track.truth)
        panels[0].plot(station[:, 0], station[:, 1] * 1e3, color=colour, lw=0.8, label=name)
        panels[1].plot(station[:, 0], np.degrees(station[:, 2]), color=colour, lw=0.8)
        flown = estimate[estimate[:, 0] >= np.nan_to_num(track.flying_since_s)]
        panels[2].plot(flown[:, 0], flown[:, 1] * 1e3, color=colour, lw=0.6)
        band = track.state[track.state[:, 0] >= np.nan_to_num(track.flying_since_s)]
        panels[2].plot(band[:, 0], 3e3 * band[:, 4], color=colour, lw=0.5, ls=":")
        panels[2].plot(band[:, 0], -3e3 * band[:, 4], color=colour, lw=0.5, ls=":")
        panels[3].plot(flown[:, 0], np.degrees(flown[:, 3]), color=colour, lw=0.6)
        panels[3].plot(band[:, 0], 3 * np.degrees(band[:, 6]), color=colour, lw=0.5, ls=":")
        panels[3].plot(band[:, 0], -3 * np.degrees(band[:, 6]), color=colour, lw=0.5, ls=":")
    for axes, label in zip(
        panels,
        (
            "off the goal, mm",
            "heading off the goal, deg",
            "estimate x - truth, mm",
            "estimate heading - truth, deg",
        ),
        strict=True,
    ):
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    panels[0].set_title("Station keeping against truth; estimates with their 3 sigma (dotted)")
    panels[0].legend()
    panels[-1].set_xlabel("t, s")
    figure.savefig(path, dpi=DPI)


def draw_valves(tracks: Mapping[str, Track], path: Path) -> None:
    """When each valve was open, as the guard let it."""
    figure = Figure(figsize=(10, 2.2 * max(1, len(tracks)) + 0.6), layout="constrained")
    panels = np.atleast_1d(figure.subplots(len(tracks), 1, sharex=True))
    for axes, colour, (name, track) in zip(panels, _cycle(), tracks.items(), strict=False):
        t, masks = track.open_masks[:, 0], track.open_masks[:, 1].astype(int)
        for valve in range(VALVES):
            moments = t[(masks >> valve) & 1 == 1]
            axes.plot(moments, np.full(len(moments), valve), "|", color=colour, ms=7, mew=0.6)
        axes.set_yticks(range(VALVES))
        axes.set_ylim(-0.7, VALVES - 0.3)
        axes.set_ylabel(f"{name}: valve")
        axes.grid(alpha=0.3)
    panels[0].set_title("Open valves")
    panels[-1].set_xlabel("t, s")
    figure.savefig(path, dpi=DPI)


def draw_fixes(tracks: Mapping[str, Track], path: Path) -> None:
    """What became of every fix: innovations and NIS of the used ones, crosses for those that were not."""
    figure = Figure(figsize=(10, 3 * 4), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True)
    labels = ("innovation x, mm", "innovation y, mm", "innovation heading, deg", "NIS")
    scales = (1e3, 1e3, 180.0 / math.pi, 1.0)
    largest = np.full(4, 1e-3)
    for track in tracks.values():
        used = np.abs(track.accounts[track.accounts[:, 1] == 1.0, 2:])
        # an estimator without NIS leaves a column without a number
        seen = np.max(used, axis=0, initial=0.0, where=np.isfinite(used))
        largest = np.maximum(largest, 1.3 * seen * scales)
    for colour, (name, track) in zip(_cycle(), tracks.items(), strict=False):
        t, is_used = track.accounts[:, 0], track.accounts[:, 1] == 1.0
        unused = Counter(
            reason for reason, used in zip(track.account_reasons, is_used, strict=True) if not used
        )
        words = "".join(f"; {count} {reason}" for reason, count in unused.most_common(4))
        for k, axes in enumerate(panels):
            # what has no innovation was never compared: it is marked on the edge
            values = np.nan_to_num(track.accounts[:, 2 + k] * scales[k], nan=largest[k])
            shown = np.clip(values, -largest[k], largest[k])
            compared = is_used & np.isfinite(track.accounts[:, 2 + k])
            label = f"{name}: {is_used.sum()} used{words}" if k == 0 else None
            axes.plot(t[compared], shown[compared], ".", color=colour, ms=4, label=label)
            axes.plot(t[~is_used], shown[~is_used], "x", color=colour, ms=6)
            starts = is_used & ~compared
            axes.plot(t[starts], shown[starts], "^", color=colour, ms=5)
    for axes, label in zip(panels, labels, strict=True):
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
    panels[3].axhline(3.0, color="black", lw=0.8, ls=":", label="expected mean of used fixes")
    panels[3].set_ylim(bottom=0.0)
    panels[0].set_title(
        "Every fix against the filter: used (dots), starting it (triangles), not used (crosses, clipped)"
    )
    figure.legend(loc="outside lower center")
    panels[-1].set_xlabel("exposure, s")
    figure.savefig(path, dpi=DPI)


def draw_latency(tracks: Mapping[str, Track], path: Path) -> None:
    """Age of the light at each stage of the chain from the exposure on, and of the bytes at the state."""
    figure = Figure(figsize=(10, 3.5), layout="constrained")
    axes = figure.add_subplot()
    found = {name: track.latency for name, track in tracks.items() if track.latency is not None}
    shown = reached_stages(found.values())
    width = 0.8 / max(1, len(found))
    for index, (colour, (name, latency)) in enumerate(zip(_cycle(), found.items(), strict=False)):
        place = np.arange(len(shown)) + (index - (len(found) - 1) / 2) * width
        low, high = (
            1e3 * np.array([dict(zip(latency.stages, ages_s, strict=True))[stage] for stage in shown])
            for ages_s in (latency.p50_s, latency.p99_s)
        )
        axes.bar(place, low, width, color=colour, label=f"{name}, median")
        axes.vlines(place, low, high, color="black", lw=1)
        axes.plot(place, high, "_", color="black", ms=8)
    axes.set_xticks(range(len(shown)), [stage.replace("_", " ") for stage in shown])
    axes.set_ylabel("age, ms")
    axes.set_title("Age of the light at each stage (line: 99th percentile); last: bytes arrived to state")
    axes.grid(axis="y", alpha=0.3)
    if found:
        axes.legend()
    figure.savefig(path, dpi=DPI)


def reached_stages(latencies: Iterable[Latency]) -> list[str]:
    """Stages at which any vehicle has an age: drawn fixes pass no picture, and no bar is no age of 0."""
    ages_s = [dict(zip(latency.stages, latency.p50_s, strict=True)) for latency in latencies]
    return [
        stage for stage in (ages_s[0] if ages_s else ()) if any(np.isfinite(row[stage]) for row in ages_s)
    ]


def _cycle() -> tuple[str, ...]:
    return _COLOURS * 4
