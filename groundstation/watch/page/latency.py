"""How old light and inertia were at each stage."""

from collections.abc import Iterable

import numpy as np

from groundstation.parts.operation.messages import Latency
from groundstation.watch.page import svg
from groundstation.watch.page.panel import WIDTH, legend, round_ticks, tick_word
from groundstation.watch.page.subject import Subject

LEFT, BAR = 110.0, 9.0


def draw_latency(subject: Subject) -> str:
    """A bar for the median of each stage and vehicle, a thin one up to the 99th percentile."""
    found = [(drawn, drawn.track.latency) for drawn in subject.drawn()]
    known = [(drawn, latency) for drawn, latency in found if latency is not None]
    stages = reached_stages(latency for _, latency in known)
    highest = [np.nanmax(latency.p99_s) for _, latency in known if np.isfinite(latency.p99_s).any()]
    if not stages or not highest:
        return ""
    most_ms = 1.05e3 * max(*highest, 1e-4)
    scale = (WIDTH - LEFT - 14.0) / most_ms
    row = BAR * len(known) + 8.0
    top, bottom = 22.0, 22.0 + row * len(stages)
    parts = legend([(drawn.kind, drawn.words) for drawn, _ in known], 12.0)
    for tick in round_ticks(0.0, most_ms, 10):
        x = LEFT + tick * scale
        parts += [
            svg.line(x, top, x, bottom, "grid"),
            svg.text(x, bottom + 14, tick_word(tick), "tick", "middle"),
        ]
    for index, stage in enumerate(stages):
        y = top + row * index + 4.0
        parts.append(svg.text(LEFT - 6, y + (row - 8) / 2 + 3.5, stage.replace("_", " "), "tick", "end"))
        for drawn, latency in known:
            low, high = (
                1e3 * dict(zip(latency.stages, ages, strict=True))[stage]
                for ages in (latency.p50_s, latency.p99_s)
            )
            if np.isfinite(low) and np.isfinite(high):
                bars = [
                    svg.rectangle(LEFT, y + 1, low * scale, BAR - 2, "bar"),
                    svg.line(LEFT + low * scale, y + BAR / 2, LEFT + high * scale, y + BAR / 2, "line"),
                    svg.line(LEFT + high * scale, y + 1, LEFT + high * scale, y + BAR - 1, "line"),
                ]
                parts.append(svg.group(bars, drawn.kind))
            y += BAR
    parts.append(svg.text(WIDTH - 14.0, bottom + 27, "age, ms", "tick", "end"))
    return svg.picture(parts, WIDTH, bottom + 32.0, "Latency by stage")


def reached_stages(latencies: Iterable[Latency]) -> list[str]:
    """Stages at which any vehicle has an age: drawn fixes pass no picture, and no bar is no age of 0."""
    ages_s = [dict(zip(latency.stages, latency.p50_s, strict=True)) for latency in latencies]
    return [
        stage for stage in (ages_s[0] if ages_s else ()) if any(np.isfinite(row[stage]) for row in ages_s)
    ]
