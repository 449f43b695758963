"""Pictures of a study: lines over time, and ways on the table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.watch.page import svg
from groundstation.watch.page.panel import (
    LEFT,
    RIGHT,
    WIDTH,
    Panel,
    Scale,
    legend,
    round_ticks,
    stacked,
    tick_word,
)

Array = NDArray[np.float64]
PANEL_HEIGHT, GAP, TOP = 120.0, 14.0, 26.0
ROOM = 0.08
"""Of a scale, above and below what is drawn."""
PLAN_HEIGHT = 430.0


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A line of a panel.

    Attributes:
        words: In the legend.
        kind: Its class: ``v0`` to ``v5``, ``truth``, with ``thick`` or ``other``.
        t_s: Ascending, shape (n,).
        values: Shape (n,).
        is_dots: Dots instead of a line.
        is_crosses: Crosses instead of a line.
    """

    words: str
    kind: str
    t_s: Array
    values: Array
    is_dots: bool = False
    is_crosses: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Axes:
    """One panel.

    Attributes:
        label: Of the values, with unit.
        lines: Drawn in order.
        span: Of the values; what the lines need if None.
        is_log: Equal ratios are equally long; it needs a span.
    """

    label: str
    lines: Sequence[Line]
    span: tuple[float, float] | None = None
    is_log: bool = False


def over_time(
    panels: Sequence[Axes],
    start_s: float,
    stop_s: float,
    label: str,
    marks_s: Sequence[float] = (),
    along: str = "t, s",
) -> str:
    """Draw panels on one time axis; their lines share one legend.

    Args:
        panels: From above.
        start_s: Left edge.
        stop_s: Right edge.
        label: What the picture shows, for those who cannot see it.
        marks_s: Moments that are marked by thin dashed lines.
        along: Name and unit of what lies along the axis, if it is not time.
    """
    drawn: list[Panel] = []
    top = TOP
    for axes in panels:
        span = axes.span or _span(axes.lines, start_s, stop_s)
        panel = Panel(top, PANEL_HEIGHT, start_s, stop_s, Scale(*span, axes.is_log), axes.label, along=along)
        for moment in marks_s:
            if start_s <= moment <= stop_s:
                x = float(panel.x(moment))
                panel.add(svg.line(x, top, x, top + PANEL_HEIGHT, "injected"))
        for line in axes.lines:
            draw = panel.crosses if line.is_crosses else panel.dots if line.is_dots else panel.line
            draw(line.t_s, line.values, line.kind)
        drawn.append(panel)
        top += PANEL_HEIGHT + GAP
    entries = dict.fromkeys((line.kind, line.words) for axes in panels for line in axes.lines if line.words)
    return stacked(drawn, (), label, legend(tuple(entries), 14.0))


def _span(lines: Sequence[Line], start_s: float, stop_s: float) -> tuple[float, float]:
    values = [line.values[(line.t_s >= start_s) & (line.t_s <= stop_s)] for line in lines]
    known = np.concatenate([each[np.isfinite(each)] for each in values] or [np.zeros(0)])
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    room = ROOM * (high - low) or 0.1 * max(abs(high), 1e-3)
    return low - room, high + room


@dataclass(frozen=True, slots=True)
class Plan:
    """A picture of the table from above.

    Attributes:
        x_span_m: Left and right edge.
        y_span_m: Lower and upper edge.
        names: What lies along the two axes.
    """

    x_span_m: tuple[float, float]
    y_span_m: tuple[float, float]
    names: tuple[str, str] = ("x, m", "y, m")

    @property
    def _scale(self) -> float:
        return min(
            (WIDTH - LEFT - RIGHT) / (self.x_span_m[1] - self.x_span_m[0]),
            PLAN_HEIGHT / (self.y_span_m[1] - self.y_span_m[0]),
        )

    def place(self, x_m: Array | float, y_m: Array | float) -> tuple[Array, Array]:
        """Return pixels of places."""
        x = LEFT + (np.asarray(x_m, float) - self.x_span_m[0]) * self._scale
        y = TOP + (self.y_span_m[1] - np.asarray(y_m, float)) * self._scale
        return x, y

    def way(self, x_m: Array, y_m: Array, kind: str) -> str:
        """A line through places."""
        return svg.path(svg.way(*self.place(x_m, y_m)), f"line {kind}")

    def dots(self, x_m: Array, y_m: Array, kind: str) -> str:
        """A dot at each place."""
        x, y = self.place(x_m, y_m)
        ways = (f"M{svg.number(a)} {svg.number(b)}h0" for a, b in zip(x.tolist(), y.tolist(), strict=True))
        return svg.path("".join(ways), f"dots {kind}")

    def asterisks(self, x_m: Array, y_m: Array, kind: str) -> str:
        """An asterisk at each place."""
        x, y = self.place(x_m, y_m)
        form = "M{0} {1}m-5 0h10m-7.5-4.3l5 8.6m0-8.6l-5 8.6"
        ways = (
            form.format(svg.number(a), svg.number(b)) for a, b in zip(x.tolist(), y.tolist(), strict=True)
        )
        return svg.path("".join(ways), f"cross {kind}")

    def arrows(self, x_m: Array, y_m: Array, dx_m: Array, dy_m: Array) -> str:
        """An arrow from each place."""
        x0, y0 = self.place(x_m, y_m)
        x1, y1 = self.place(x_m + dx_m, y_m + dy_m)
        rows = zip(x0.tolist(), y0.tolist(), x1.tolist(), y1.tolist(), strict=True)
        ways = []
        for a, b, c, d in rows:
            along, across = 0.25 * (a - c), 0.25 * (b - d)
            left = f"L{svg.number(c + along - 0.5 * across)} {svg.number(d + across + 0.5 * along)}"
            right = f"L{svg.number(c + along + 0.5 * across)} {svg.number(d + across - 0.5 * along)}"
            tip = f"{svg.number(c)} {svg.number(d)}"
            ways.append(f"M{svg.number(a)} {svg.number(b)}L{tip}{left}M{tip}{right}")
        return svg.path("".join(ways), "arrow")

    def picture(self, parts: Sequence[str], entries: Sequence[tuple[str, str]], label: str) -> str:
        """The picture, with its axes; entries are class and words of the legend."""
        left, top = (float(each) for each in self.place(self.x_span_m[0], self.y_span_m[1]))
        right, bottom = (float(each) for each in self.place(self.x_span_m[1], self.y_span_m[0]))
        around = [svg.rectangle(left, top, right - left, bottom - top, "frame")]
        for tick in round_ticks(*self.x_span_m, 8):
            x = float(self.place(tick, 0.0)[0])
            around.append(svg.line(x, top, x, bottom, "grid"))
            around.append(svg.text(x, bottom + 14.0, tick_word(tick), "tick", "middle"))
        for tick in round_ticks(*self.y_span_m, 6):
            y = float(self.place(0.0, tick)[1])
            around.append(svg.line(left, y, right, y, "grid"))
            around.append(svg.text(left - 5.0, y + 3.5, tick_word(tick), "tick", "end"))
        around.append(svg.text(right, bottom + 27.0, self.names[0], "tick", "end"))
        around.append(svg.text(left - 40.0, top + 8.0, self.names[1], "tick"))
        return svg.picture([*legend(entries, 14.0), *around, *parts], WIDTH, bottom + 32.0, label)
