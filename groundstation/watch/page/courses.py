"""Pictures over time: modes and faults, errors, estimates, valves and gas, fixes."""

import math

import numpy as np

from groundstation.parts.control.gauges import station_errors
from groundstation.parts.reference.gauges import estimate_errors
from groundstation.parts.valves.pulses import open_s
from groundstation.watch.page import svg
from groundstation.watch.page.decimation import share
from groundstation.watch.page.panel import (
    COLUMNS,
    NUMBER_HEIGHT,
    Panel,
    Scale,
    around_zero,
    decades,
    legend,
    stacked,
)
from groundstation.watch.page.subject import Drawn, Subject
from groundstation.watch.tracks import Array

LEGEND_HEIGHT = 18.0
GAP = 12.0
LEAST_ERROR_MM, LEAST_ERROR_DEG = 0.1, 0.01
"""Lower edges of the logarithmic scales."""
ROW = 20.0
_SHOWN = ("flying", "braking", "holding", "stopped", "landing", "lost")


def draw_happenings(subject: Subject) -> str:
    """Modes of each vehicle as a row, with everything that happened."""
    start, stop = subject.span
    rows = [drawn for name in subject.names for drawn in reversed([*subject.drawn(name)])]
    words = [
        (len(rows) - 0.5 - index, drawn.name if drawn.run is subject.run else "compared")
        for index, drawn in enumerate(rows)
    ]
    panel = Panel(NUMBER_HEIGHT, ROW * len(rows), start, stop, Scale(0.0, float(len(rows))), "", words)
    for index, drawn in enumerate(rows):
        _mode_row(panel, drawn, panel.top + ROW * index)
    return stacked([panel], subject.numbered(), "Modes and events")


def _mode_row(panel: Panel, drawn: Drawn, top: float) -> None:
    ends = [t_s for t_s, _ in drawn.track.modes[1:]] + [drawn.run.duration_s]
    for (since_s, mode), until_s in zip(drawn.track.modes, ends, strict=True):
        left, right = (float(panel.x(max(t_s - drawn.zero_s, panel.start))) for t_s in (since_s, until_s))
        kind = mode if mode in _SHOWN else "ground-mode"
        title = f"{drawn.name}: {mode}, {since_s - drawn.zero_s:.1f} to {until_s - drawn.zero_s:.1f} s"
        panel.add(svg.rectangle(left, top + 3, right - left, ROW - 6, f"mode-{kind}", title))
        if right - left > 7.0 * len(mode):
            panel.add(svg.text((left + right) / 2, top + ROW / 2 + 3.5, mode, "mode-word", "middle"))


def draw_errors(subject: Subject) -> str:
    """How far each vehicle was from the setpoint that its controller worked for."""
    start, stop = subject.span
    found = [(drawn, off_setpoint(drawn)) for drawn in subject.drawn()]
    position = decades(*(1e3 * rows[:, 1] for _, rows in found), least=LEAST_ERROR_MM)
    heading = decades(*(np.degrees(np.abs(rows[:, 2])) for _, rows in found), least=LEAST_ERROR_DEG)
    top = LEGEND_HEIGHT + NUMBER_HEIGHT
    panels = [
        Panel(top, 150.0, start, stop, position, "position, mm"),
        Panel(top + 150.0 + GAP, 150.0, start, stop, heading, "heading, deg"),
    ]
    for drawn, rows in found:
        t = drawn.t(rows)
        panels[0].line(t, 1e3 * rows[:, 1], drawn.kind)
        panels[1].line(t, np.degrees(np.abs(rows[:, 2])), drawn.kind)
    words = [(drawn.kind, drawn.words) for drawn, _ in found]
    return stacked(panels, subject.numbered(), "Errors against the setpoint", legend(words, 12.0))


def off_setpoint(drawn: Drawn) -> Array:
    """Rows of t (s), distance (m), turn (rad) in flight, by truth where there is any; shape (n, 3)."""
    track = drawn.track
    rows = track.truth if len(track.truth) else track.state
    return station_errors(rows, track.goal, first_flight_s(drawn))


def first_flight_s(drawn: Drawn) -> float:
    """When the vehicle flew first; NaN if it never did."""
    return next((t_s for t_s, mode in drawn.track.modes if mode == "flying"), math.nan)


def draw_estimate(subject: Subject, name: str) -> str:
    """Estimate minus truth of one vehicle, with the three sigma that the filter states."""
    start, stop = subject.span
    axes = (("x, mm", 1e3, 1, 4), ("y, mm", 1e3, 2, 5), ("heading, deg", 180.0 / math.pi, 3, 6))
    found = []
    for drawn in subject.drawn(name):
        state = drawn.track.state[drawn.track.state[:, 0] >= np.nan_to_num(first_flight_s(drawn))]
        found.append((drawn, state, estimate_errors(state, drawn.track.truth)))
    panels, top = [], LEGEND_HEIGHT + NUMBER_HEIGHT
    for label, scale, error, sigma in axes:
        sizes = [
            part for _, state, rows in found for part in (scale * rows[:, error], 3 * scale * state[:, sigma])
        ]
        panel = Panel(top, 96.0, start, stop, around_zero(*sizes, least=1e-2), label)
        for drawn, state, _ in found:
            panel.band(drawn.t(state), 3 * scale * state[:, sigma], drawn.kind)
        for drawn, _, rows in found:
            panel.line(drawn.t(rows), scale * rows[:, error], drawn.kind)
        panels.append(panel)
        top += 96.0 + GAP
    words = [
        (drawn.kind, drawn.words + ("" if len(rows) else " (no truth was recorded: only 3 sigma)"))
        for drawn, _, rows in found
    ]
    return stacked(panels, subject.numbered(name), f"{name}: estimate minus truth", legend(words, 12.0))


def draw_valves(subject: Subject, name: str) -> str:
    """When the valves of one vehicle were open, the gas that this took, and the pressure of its tank."""
    start, stop = subject.span
    found = list(subject.drawn(name))
    top = LEGEND_HEIGHT + NUMBER_HEIGHT
    valves = max(drawn.track.on_times.shape[1] - 1 for drawn in found)
    rows = [(float(valve), str(valve)) for valve in range(valves)]
    raster = Panel(top, 11.0 * valves, start, stop, Scale(valves - 0.5, -0.5), "valve", rows)
    for drawn in found:
        for valve in range(drawn.track.on_times.shape[1] - 1):
            _raster_row(raster, drawn, valve)
    panels = [raster]
    top += raster.height + GAP
    gas = [(drawn, drawn.run.gas(name)) for drawn in found]
    largest = max((float(rows[-1, 1]) for _, rows in gas if len(rows)), default=0.0)
    panels.append(Panel(top, 70.0, start, stop, Scale(0.0, 1.1 * largest or 1.0), "gas, N s"))
    for drawn, used in gas:
        panels[-1].line(drawn.t(used), used[:, 1], drawn.kind)
    top += 70.0 + GAP
    pressures = [1e-5 * drawn.track.pressure[:, 1] for drawn in found if len(drawn.track.pressure)]
    if pressures:
        low, high = min(map(np.min, pressures)), max(map(np.max, pressures))
        room = max(0.05 * (high - low), 0.005 * high, 1e-3)
        panels.append(
            Panel(top, 70.0, start, stop, Scale(float(low - room), float(high + room)), "tank, bar")
        )
        for drawn in found:
            panels[-1].line(drawn.t(drawn.track.pressure), 1e-5 * drawn.track.pressure[:, 1], drawn.kind)
    words = [(drawn.kind, drawn.words) for drawn in found]
    return stacked(panels, subject.numbered(name), f"{name}: valves and gas", legend(words, 12.0))


def _raster_row(panel: Panel, drawn: Drawn, valve: int) -> None:
    """A bar in each column of pixels, as high as the share of the column that the valve was open."""
    rows = drawn.track.on_times
    is_open = rows[:, 1 + valve] > 0.0
    if not is_open.any():
        return
    opened_s = open_s(rows[:, 0], rows[:, 1:])[is_open, valve]
    height = share(drawn.t(rows)[is_open], opened_s, panel.start, panel.stop, COLUMNS)
    edges = panel.x(np.linspace(panel.start, panel.stop, COLUMNS + 1))
    base = float(panel.y(float(valve))) + 4.5
    data = ""
    for column in np.flatnonzero(height > 0.0).tolist():
        tall = max(9.0 * float(height[column]), 1.5)  # a short pulse is seen, too
        data += f"M{edges[column]:.1f} {base:.1f}v-{tall:.1f}"
    panel.add(svg.path(data, f"raster {drawn.kind}"))


def draw_fixes(subject: Subject) -> str:
    """Every fix against the filter: innovations and NIS of used ones, crosses for those that were not."""
    start, stop = subject.span
    axes = (("x, mm", 1e3), ("y, mm", 1e3), ("heading, deg", 180.0 / math.pi), ("NIS", 1.0))
    found = list(subject.drawn())
    panels, top = [], LEGEND_HEIGHT + NUMBER_HEIGHT
    for column, (label, scale) in enumerate(axes):
        used = [scale * d.track.accounts[d.track.accounts[:, 1] == 1.0, 2 + column] for d in found]
        bounds = around_zero(*used, least=1e-3)
        bounds = bounds if column < 3 else Scale(0.0, max(bounds.high, 8.0))
        panel = Panel(top, 84.0, start, stop, bounds, label)
        for drawn in found:
            rows = drawn.track.accounts
            is_used = rows[:, 1] == 1.0
            # what has no innovation was never compared: it is marked on the edge
            values = np.nan_to_num(scale * rows[:, 2 + column], nan=bounds.high)
            t, compared = drawn.t(rows), is_used & np.isfinite(rows[:, 2 + column])
            panel.dots(t[compared], values[compared], drawn.kind)
            panel.crosses(t[~is_used], values[~is_used], drawn.kind)
        if column == 3:
            y = float(panel.y(3.0))
            panel.add(svg.line(float(panel.x(start)), y, float(panel.x(stop)), y, "line expected"))
        panels.append(panel)
        top += 84.0 + GAP
    words = [(drawn.kind, drawn.words) for drawn in found]
    return stacked(panels, subject.numbered(), "Fixes against the filter", legend(words, 12.0))
