"""What people are shown of two sources of fixes: when they begin to disagree, and the sum of a recording."""

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.view import NOTHING, Cell, Figure, Gauge, GaugeRow, Newest
from groundstation.parts.overhead.messages import FixComparison


class RefereeGauge(Gauge):
    """Reports when star fixes and overhead fixes begin to disagree, and when they agree again."""

    every = (FixComparison,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._verdict = ""

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, FixComparison)
        if message.verdict != self._verdict and "disagree" in (message.verdict, self._verdict):
            verdict = f"{message.verdict}: {message.reason}" if message.reason else message.verdict
            yield f"{self.vehicle}: star fixes and overhead fixes {verdict}"
        self._verdict = message.verdict

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        return NOTHING


class ComparisonFigure(Figure):
    """Star fixes against overhead fixes over a whole recording, and the last verdict of the referee."""

    inputs = (FixComparison,)

    def __init__(self) -> None:
        self._pairs: list[FixComparison] = []

    def take(self, message: Message, t_s: float) -> None:
        del t_s
        assert isinstance(message, FixComparison)
        self._pairs.append(message)

    def values(self) -> dict[str, Any]:
        pairs = self._pairs
        if not pairs:
            return {}
        differences = np.array([pair.difference for pair in pairs])
        mean, rms = differences.mean(axis=0), np.sqrt((differences**2).mean(axis=0))
        summary = {
            "pairs": len(pairs),
            "mean_mm_mm_deg": [*(mean[:2] * 1e3).tolist(), math.degrees(mean[2])],
            "rms_mm_mm_deg": [*(rms[:2] * 1e3).tolist(), math.degrees(rms[2])],
            "nis_over_3": float(np.mean([pair.nis for pair in pairs])) / 3.0,
            "disagreed_ratio": float(np.mean([pair.verdict == "disagree" for pair in pairs])),
            "last_verdict": pairs[-1].verdict,
            "reason": pairs[-1].reason,
        }
        return {"star_against_overhead": summary}


GAUGES = (GaugeRow(140, RefereeGauge),)
