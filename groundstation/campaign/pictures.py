"""Histograms and scatters of a campaign's page."""

from collections.abc import Iterable, Sequence

import numpy as np

from groundstation.campaign.flying import Row
from groundstation.campaign.statistics import Array, Driver, LimitRuns, numbers
from groundstation.watch.page import svg
from groundstation.watch.page.panel import Scale, round_ticks, tick_word

WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 430.0, 200.0, 46.0, 20.0, 34.0
BINS = 30


def side_by_side(found: Iterable[str]) -> str:
    """Pictures as the page lays them out; nothing for none."""
    drawn = "".join(found)
    return f'<div class="pictures">{drawn}</div>\n' if drawn else ""


def _span(values: Array, bounds: Sequence[float]) -> tuple[float, float]:
    """Of an axis: most of the values and the bounds."""
    low, high = float(values.min()), float(values.max())
    near = [bound for bound in bounds if low - 3 * (high - low) <= bound <= high + 3 * (high - low)]
    low, high = min([low, *near]), max([high, *near])
    room = 0.04 * (high - low) or max(abs(high), 1.0) * 0.05
    return low - room, high + room


def _x(value: float, span: tuple[float, float]) -> float:
    return LEFT + (WIDTH - LEFT - 8.0) * (value - span[0]) / (span[1] - span[0])


def _axis(span: tuple[float, float], label: str) -> list[str]:
    base = HEIGHT - BOTTOM
    parts = [svg.rectangle(LEFT, TOP, WIDTH - LEFT - 8.0, base - TOP, "frame")]
    for tick in round_ticks(*span, 6):
        parts.append(svg.line(_x(tick, span), TOP, _x(tick, span), base, "grid"))
        parts.append(
            svg.text(min(_x(tick, span), WIDTH - 20.0), base + 13.0, tick_word(tick), "tick", "middle")
        )
    parts.append(svg.text(WIDTH - 8.0, HEIGHT - 5.0, label, "tick", "end"))
    return parts


def _bounds(limit: LimitRuns) -> list[float]:
    return [bound for bound in (limit.below, limit.above) if bound is not None]


def histogram(limit: LimitRuns) -> str:
    """How the quantity of a limit is spread over the runs."""
    values = limit.values[np.isfinite(limit.values)]
    span = _span(values, _bounds(limit))
    counts, edges = np.histogram(values, BINS, span)
    base, most = HEIGHT - BOTTOM, max(int(counts.max()), 1)
    parts = _axis(span, limit.name)
    for count, low, high in zip(counts.tolist(), edges, edges[1:], strict=False):
        height = (base - TOP - 6.0) * count / most
        if count:
            width = max(_x(high, span) - _x(low, span) - 0.8, 0.8)
            parts.append(
                svg.rectangle(_x(low, span), base - height, width, height, "bar v0", f"{count} runs")
            )
    parts.append(svg.text(LEFT - 5.0, TOP + 10.0, str(most), "tick", "end"))
    parts += [
        svg.line(_x(bound, span), TOP, _x(bound, span), base, "bound")
        for bound in _bounds(limit)
        if span[0] <= bound <= span[1]
    ]
    return svg.picture(parts, WIDTH, HEIGHT, f"Histogram of {limit.name}")


def scatter(driver: Driver, rows: Sequence[Row]) -> str:
    """The quantity of a limit against what was drawn."""
    limit, drawn = driver.limit, numbers(rows, driver.key)
    known = np.isfinite(drawn) & np.isfinite(limit.values)
    x, y = drawn[known], limit.values[known]
    across, up = _span(x, ()), _span(y, _bounds(limit))
    base = HEIGHT - BOTTOM
    scale = Scale(*up)
    parts = _axis(across, driver.key)
    for tick in scale.ticks():
        place = base - (base - TOP) * float(scale.share(tick))
        parts.append(svg.text(LEFT - 5.0, place + 3.5, tick_word(tick), "tick", "end"))
    for held, kind in ((True, "v0"), (False, "broken")):
        chosen = limit.held[known] == held
        ways = [
            f"M{svg.number(_x(here, across))} {svg.number(base - (base - TOP) * float(scale.share(there)))}h0"
            for here, there in zip(x[chosen].tolist(), y[chosen].tolist(), strict=True)
        ]
        parts.append(svg.path("".join(ways), f"dots {kind}"))
    for bound in _bounds(limit):
        if up[0] <= bound <= up[1]:
            place = base - (base - TOP) * float(scale.share(bound))
            parts.append(svg.line(LEFT, place, WIDTH - 8.0, place, "bound"))
    parts.append(svg.text(LEFT, TOP - 6.0, f"{limit.name}, r = {driver.correlation:.2f}", "legend"))
    return svg.picture(parts, WIDTH, HEIGHT, f"{limit.name} against {driver.key}")
