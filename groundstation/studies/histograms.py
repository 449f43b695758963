"""Pictures of a study that have no time axis: distributions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.studies.plots import GAP, PANEL_HEIGHT, TOP
from groundstation.watch.page import svg
from groundstation.watch.page.panel import Panel, Scale, legend, stacked

Array = NDArray[np.float64]


def histograms(
    rows: Sequence[tuple[str, Sequence[Array]]],
    entries: Sequence[tuple[str, str]],
    half: float,
    bins: int,
    label: str,
    along: str,
) -> str:
    """Draw shares of values in equal bins from minus to plus half a width, a panel for each row.

    Args:
        rows: Name, and the values of each entry; what lies outside is counted in the outermost bins.
        entries: Class and words of each set of values: the first as bars, the others as outlines.
        half: Of the axis.
        bins: How many.
        label: What is shown, for those who cannot see it.
        along: Name and unit of the values.
    """
    edges = np.linspace(-half, half, bins + 1)
    panels: list[Panel] = []
    top = TOP
    for name, sets in rows:
        inside = [np.clip(values, -half * (1 - 1e-9), half * (1 - 1e-9)) for values in sets]
        shares = [np.histogram(values, edges)[0] / max(1, len(values)) for values in inside]
        scale = Scale(0.0, 1.1 * max(float(each.max()) for each in shares))
        panel = Panel(top, PANEL_HEIGHT, -half, half, scale, name, along=along)
        x, bottom = panel.x(edges), float(panel.y(0.0))
        for number, ((kind, _), share) in enumerate(zip(entries, shares, strict=True)):
            heights = panel.y(share)
            if number == 0:
                for left, right, y in zip(x[:-1].tolist(), x[1:].tolist(), heights.tolist(), strict=True):
                    panel.add(svg.rectangle(left + 0.5, y, right - left - 1.0, bottom - y, f"bar {kind}"))
                continue
            way = np.repeat(x, 2)
            level = np.concatenate(([bottom], np.repeat(heights, 2), [bottom]))
            panel.add(svg.path(svg.way(way, level), f"line {kind}"))
        panels.append(panel)
        top += PANEL_HEIGHT + GAP
    return stacked(panels, (), label, legend(entries, 14.0))
