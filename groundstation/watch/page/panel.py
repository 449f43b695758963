"""A panel of a picture: a time axis, an axis of values, marks, and what is drawn between them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from groundstation.watch.page import svg
from groundstation.watch.page.decimation import as_line, envelope
from groundstation.watch.run_events import Mark

Array = NDArray[np.float64]
WIDTH, LEFT, RIGHT = 900.0, 64.0, 8.0
COLUMNS = 700
"""Points of time that a line has at most: finer than print shows."""
BAND_COLUMNS = 260
MOST_DOTS = 1200
NUMBER_HEIGHT = 13.0
"""Above a picture's first panel, where the numbers of the marks stand."""
_NEXT_NUMBER = 13.0


@dataclass(frozen=True, slots=True)
class Scale:
    """How values become pixels.

    Attributes:
        low: At the lower edge.
        high: At the upper edge.
        is_log: Equal ratios are equally long.
    """

    low: float
    high: float
    is_log: bool = False

    def share(self, values: Array | float) -> Array:
        """0 at the lower edge, 1 at the upper; clipped a little beyond both."""
        found = np.asarray(values, float)
        low, high = self.low, self.high
        if self.is_log:
            found, low, high = np.log(np.maximum(found, low)), math.log(low), math.log(high)
        return np.clip((found - low) / (high - low), 0.0, 1.0)

    def ticks(self, most: int = 5) -> list[float]:
        """Round values, few enough to be read."""
        if self.is_log:
            first, last = math.ceil(math.log10(self.low) - 1e-9), math.floor(math.log10(self.high) + 1e-9)
            return [10.0**power for power in range(first, last + 1)]
        return round_ticks(self.low, self.high, most)


def round_ticks(low: float, high: float, most: int) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten between two values."""
    span = (high - low) / max(most, 1)
    power = 10.0 ** math.floor(math.log10(span)) if span > 0.0 else 1.0
    step = next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= span * (1 - 1e-9))
    return [step * index for index in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)]


def around_zero(*parts: Array, least: float, share: float = 0.995) -> Scale:
    """A scale for values on both sides of zero; the wildest few may be cut off at its edge.

    Args:
        parts: Values; those without a number do not count.
        least: Half of the scale at least.
        share: Of the values of each part that lie inside for certain.
    """
    half = least
    for part in parts:
        sizes = np.abs(part[np.isfinite(part)])
        if len(sizes):
            half = max(half, 1.15 * float(np.quantile(sizes, share)))
    return Scale(-half, half)


def decades(*parts: Array, least: float) -> Scale:
    """A logarithmic scale from ``least`` to the next decade above all values."""
    largest = max((float(np.nanmax(part)) for part in parts if np.isfinite(part).any()), default=10.0 * least)
    return Scale(
        least, 10.0 ** max(math.ceil(math.log10(max(largest, least))), math.log10(least) + 1.0), is_log=True
    )


@dataclass
class Panel:
    """One panel.

    Args:
        top: Its upper edge in the picture.
        height: Of the plot.
        start: Time at the left edge.
        stop: Time at the right edge.
        scale: Of the values.
        label: Of the values, with unit.
        words: Instead of round values: what stands beside values of the scale.
        along: Name and unit of what lies along the axis of times.
    """

    top: float
    height: float
    start: float
    stop: float
    scale: Scale
    label: str
    words: Sequence[tuple[float, str]] | None = None
    along: str = "t, s"
    _parts: list[str] = field(default_factory=list)

    def x(self, t: Array | float) -> Array:
        """Pixels of moments."""
        share = (np.asarray(t, float) - self.start) / (self.stop - self.start)
        return LEFT + (WIDTH - LEFT - RIGHT) * share

    def y(self, values: Array | float) -> Array:
        """Pixels of values."""
        return self.top + self.height * (1.0 - self.scale.share(values))

    def add(self, part: str) -> None:
        """Draw anything."""
        self._parts.append(part)

    def line(self, t: Array, values: Array, kind: str) -> None:
        """A line, broken where there is no value."""
        drawn_t, drawn = as_line(envelope(t, values, self.start, self.stop, COLUMNS))
        self.add(svg.path(svg.way(self.x(drawn_t), self.y(drawn)), f"line {kind}"))

    def band(self, t: Array, half: Array, kind: str) -> None:
        """An area between plus and minus half its width, drawn as wide as it was at most."""
        found = envelope(t, half, self.start, self.stop, BAND_COLUMNS)
        pieces = np.split(np.arange(len(found.t)), np.flatnonzero(~np.isfinite(found.high)))
        data = ""
        for piece in pieces:
            piece = piece[np.isfinite(found.high[piece])]
            if len(piece) > 1:
                x, high = self.x(found.t[piece]), found.high[piece]
                around = np.concatenate([self.y(high), self.y(-high)[::-1]])
                data += svg.way(np.concatenate([x, x[::-1]]), around) + "Z"
        self.add(svg.path(data, f"band {kind}"))

    def dots(self, t: Array, values: Array, kind: str) -> None:
        """A dot for each value; where they are many, a stroke from least to largest in each column."""
        if len(t) <= MOST_DOTS:
            ways = (f"M{svg.number(x)} {svg.number(y)}h0" for x, y in self._seen(t, values))
            self.add(svg.path("".join(ways), f"dots {kind}"))
            return
        found = envelope(t, values, self.start, self.stop, COLUMNS)
        rows = zip(
            self.x(found.t).tolist(), self.y(found.low).tolist(), self.y(found.high).tolist(), strict=True
        )
        ways = (
            f"M{svg.number(x)} {svg.number(low)}V{svg.number(high)}" for x, low, high in rows if low == low
        )
        self.add(svg.path("".join(ways), f"dots {kind}"))

    def crosses(self, t: Array, values: Array, kind: str) -> None:
        """A cross for each value; those that would lie on one another are drawn once."""
        places = dict.fromkeys((round(x), round(y)) for x, y in self._seen(t, values))
        ways = (f"M{x - 3} {y - 3}l6 6m0-6l-6 6" for x, y in places)
        self.add(svg.path("".join(ways), f"cross {kind}"))

    def _seen(self, t: Array, values: Array) -> list[tuple[float, float]]:
        inside = (t >= self.start) & (t <= self.stop) & np.isfinite(values)
        return list(zip(self.x(t[inside]).tolist(), self.y(values[inside]).tolist(), strict=True))

    def render(self, marks: Sequence[tuple[int, Mark]], *, is_first: bool, is_last: bool) -> str:
        """The panel with grid, frame and marks.

        Args:
            marks: With their numbers.
            is_first: Of the picture: the numbers stand above it.
            is_last: Of the picture: the times stand below it.
        """
        right, bottom = WIDTH - RIGHT, self.top + self.height
        grid: list[str] = []
        words = self.words
        if words is None:
            words = [(tick, tick_word(tick)) for tick in self.scale.ticks()]
        for tick, word in words:
            y = float(self.y(tick))
            if self.words is None:
                grid.append(svg.line(LEFT, y, right, y, "grid"))
            grid.append(svg.text(LEFT - 5, y + 3.5, word, "tick", "end"))
        for tick in round_ticks(self.start, self.stop, 12):
            x = float(self.x(tick))
            grid.append(svg.line(x, self.top, x, bottom, "grid"))
            if is_last:
                grid.append(svg.text(x, bottom + 14, tick_word(tick), "tick", "middle"))
        middle = self.top + self.height / 2
        frame = [svg.rectangle(LEFT, self.top, right - LEFT, self.height, "frame")]
        frame.append(svg.text(13, middle, self.label, "label", "middle", turn=-90.0))
        if is_last:
            frame.append(svg.text(right, bottom + 27, self.along, "tick", "end"))
        return "".join(
            [*grid, *self._parts, svg.group(self._marks(marks, is_first=is_first), "marks"), *frame]
        )

    def _marks(self, marks: Sequence[tuple[int, Mark]], *, is_first: bool) -> list[str]:
        out: list[str] = []
        free_from = -math.inf
        bottom = self.top + self.height
        for index, mark in marks:
            until_s = mark.t_s if mark.until_s is None else mark.until_s
            if until_s < self.start or mark.t_s > self.stop:
                continue
            begin = float(self.x(max(mark.t_s, self.start)))
            if mark.until_s is not None:
                width = float(self.x(min(until_s, self.stop))) - begin
                out.append(svg.rectangle(begin, self.top, width, self.height, f"span {mark.kind}", mark.text))
            out.append(svg.line(begin, self.top, begin, bottom, f"mark {mark.kind}"))
            if is_first and begin >= free_from:
                out.append(svg.text(begin, self.top - 3, str(index), f"number {mark.kind}", "middle"))
                free_from = begin + _NEXT_NUMBER
        return out


def tick_word(tick: float) -> str:
    """A round value in words."""
    return f"{tick:g}".replace("-", "\u2212") if abs(tick) < 1e5 else f"{tick:.0e}"


def stacked(
    panels: Sequence[Panel], marks: Sequence[tuple[int, Mark]], label: str, above: Sequence[str] = ()
) -> str:
    """A picture of panels on one time axis."""
    last = panels[-1]
    drawn = (panel.render(marks, is_first=panel is panels[0], is_last=panel is last) for panel in panels)
    return svg.picture([*above, *drawn], WIDTH, last.top + last.height + 32.0, label)


def legend(entries: Sequence[tuple[str, str]], y: float) -> list[str]:
    """Class and words of each line, side by side; a picture of one line needs none."""
    out: list[str] = []
    x = LEFT
    if len(entries) < 2:
        return out
    for kind, words in entries:
        out.append(svg.line(x, y - 4, x + 20, y - 4, f"line {kind}"))
        out.append(svg.text(x + 25, y, words, "legend"))
        x += 25 + 6.2 * len(words) + 22
    return out
