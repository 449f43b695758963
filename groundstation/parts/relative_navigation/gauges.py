"""What people are shown of relative navigation: where the other mock-up is seen, and why it is not."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.readings import counts_cell
from groundstation.declarations.view import NOTHING, Cell, Figure, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.relative_navigation.messages import RelativePose

TELLING = 5
"""Pictures in a row without the other mock-up before people are told."""


class SightingGauge(Gauge):
    """Distance and bearing of the mock-up that the side camera looks for, or why it is not seen."""

    label = "sees"
    newest = (RelativePose,)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        pose = newest.get(RelativePose)
        if pose is None:
            return NOTHING
        if pose.status != "solved":
            return cell(f"{pose.seen} {pose.status}: {pose.reason}", Level.BAD)
        turn = ""
        if not math.isnan(pose.relative_heading_rad):
            turn = f", turned by {math.degrees(pose.relative_heading_rad):.1f} deg"
        bearing_deg = math.degrees(pose.bearing_body_rad)
        return cell(f"{pose.seen} at {1e3 * pose.range_m:.0f} mm, {bearing_deg:.1f} deg{turn}")


class UnseenGauge(Gauge):
    """Reports when the mock-up is no longer seen, and when it is again; how often each reason was given."""

    label = "  unseen"
    every = (RelativePose,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._reasons: dict[str, int] = {}
        self._in_a_row = 0

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, RelativePose)
        if message.status == "solved":
            if self._in_a_row >= TELLING:
                yield f"{self.vehicle}: sees {message.seen} again"
            self._in_a_row = 0
            return
        kind = message.reason.partition(":")[0]
        self._reasons[kind] = self._reasons.get(kind, 0) + 1
        self._in_a_row += 1
        if self._in_a_row == TELLING:
            yield f"{self.vehicle}: does not see {message.seen}: {message.reason}"

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        return counts_cell(self._reasons) if self._reasons else NOTHING


class SightingFigure(Figure):
    """Share of the pictures that showed the other mock-up, how far it was, and why the others did not."""

    inputs = (RelativePose,)

    def __init__(self) -> None:
        self._ranges_m: list[float] = []
        self._misfits: list[float] = []
        self._reasons: dict[str, int] = {}
        self._with_heading = 0

    def take(self, message: Message, t_s: float) -> None:
        del t_s
        assert isinstance(message, RelativePose)
        if message.status != "solved":
            self._reasons[message.reason] = self._reasons.get(message.reason, 0) + 1
            return
        self._ranges_m.append(message.range_m)
        self._misfits.append(message.misfit_ratio)
        self._with_heading += not math.isnan(message.relative_heading_rad)

    def values(self) -> dict[str, Any]:
        solved = len(self._ranges_m)
        pictures = solved + sum(self._reasons.values())
        if not pictures:
            return {}
        summary: dict[str, Any] = {
            "pictures": pictures,
            "solved_ratio": solved / pictures,
            "with_heading_ratio": self._with_heading / pictures,
            "unseen": self._reasons,
        }
        if solved:
            summary |= {
                "range_mm": [1e3 * min(self._ranges_m), 1e3 * max(self._ranges_m)],
                "mean_misfit": float(np.mean(self._misfits)),
            }
        return {"side_camera": summary}


GAUGES = (GaugeRow(144, SightingGauge), GaugeRow(146, UnseenGauge))
