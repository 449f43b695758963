"""What people are shown of the estimate: the pose, and what became of the fixes."""

import math
from collections import deque
from collections.abc import Iterator
from typing import Any

import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.readings import column, counts_cell, pose_cell
from groundstation.declarations.view import NOTHING, Cell, Figure, Gauge, GaugeRow, Level, Newest, cell
from groundstation.parts.fusion.messages import FixAccount, FusionStatus, VehicleState
from groundstation.parts.stars.messages import StarFix

OLD_FIX_S = 3.0
NIS_KEPT = 30


class PoseGauge(Gauge):
    """Where the vehicle is."""

    label = "position, heading"
    newest = (VehicleState,)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        state = newest.get(VehicleState)
        if state is None:
            return NOTHING
        x, y = state.position_table_m
        shown = cell(f"{x * 1e3:8.1f} {y * 1e3:8.1f} mm {math.degrees(state.heading_rad):8.2f} deg")
        return shown + cell("  LOST", Level.BAD) if state.status == "lost" else shown

    def phrase(self, newest: Newest, now_ns: int) -> str:
        del now_ns
        state = newest.get(VehicleState)
        x, y, heading = (math.nan,) * 3
        if state is not None:
            (x, y), heading = state.position_table_m, state.heading_rad
        return f"{column(x * 1e3, 8, 1)} {column(y * 1e3, 8, 1)} mm {column(math.degrees(heading), 7, 2)} deg"


class FixesGauge(Gauge):
    """How often fixes come, how many were used, how old the newest of those is."""

    label = "star fixes"
    newest = (FusionStatus,)
    rated = (StarFix,)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        fusion = newest.get(FusionStatus)
        if fusion is None:
            return NOTHING
        shown = cell(f"{newest.rate_hz(StarFix, now_ns):5.1f} /s")
        shown += cell(f"  {fusion.fixes_used} used, {fusion.fixes_refused} refused", Level.FAINT)
        if not math.isfinite(fusion.fix_age_s):
            return shown
        return shown + cell(
            f"  age {fusion.fix_age_s:.2f} s", Level.BAD if fusion.fix_age_s > OLD_FIX_S else Level.PLAIN
        )

    def phrase(self, newest: Newest, now_ns: int) -> str:
        fusion = newest.get(FusionStatus)
        age_s, used, refused = (
            (math.inf, 0, 0)
            if fusion is None
            else (fusion.fix_age_s, fusion.fixes_used, fusion.fixes_refused)
        )
        return (
            f"fix {newest.rate_hz(StarFix, now_ns):4.1f}/s age {column(age_s, 4, 2)} s "
            f"used {used} refused {refused}"
        )


class InnovationGauge(Gauge):
    """How far the newest fix lay from what was expected, and the mean NIS of the last ones (3 expected)."""

    label = "  innovation, NIS"
    every = (FixAccount,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._account: FixAccount | None = None
        self._nis: deque[float] = deque(maxlen=NIS_KEPT)

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, FixAccount)
        self._account = message
        if message.used and math.isfinite(message.nis):
            self._nis.append(message.nis)
        yield from ()

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        account = self._account
        if account is None or math.isnan(account.nis):
            return NOTHING
        x, y, turn = account.innovation
        shown = pose_cell(math.hypot(x, y), turn, Level.PLAIN if account.used else Level.BAD)
        shown += cell(f"  {account.nis:.1f}")
        if not self._nis:
            return shown
        return shown + cell(f", mean {sum(self._nis) / len(self._nis):.1f} of 3", Level.FAINT)


class UnusedGauge(Gauge):
    """Fixes that the estimator did not use, by reason."""

    label = "  not used"
    every = (FixAccount,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._unused: dict[str, int] = {}

    def take(self, message: Message, now_ns: int) -> Iterator[str]:
        del now_ns
        assert isinstance(message, FixAccount)
        if not message.used:
            self._unused[message.reason] = self._unused.get(message.reason, 0) + 1
        yield from ()

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del newest, now_ns
        return counts_cell(self._unused) if self._unused else NOTHING


class FixFigure(Figure):
    """What became of the fixes, and how far the used ones lay from what was expected."""

    inputs = (FixAccount,)

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}
        self._used: list[tuple[float, float, float, float]] = []

    def take(self, message: Message, t_s: float) -> None:
        del t_s
        assert isinstance(message, FixAccount)
        reason = "used" if message.used else message.reason
        self._counts[reason] = self._counts.get(reason, 0) + 1
        if message.used and math.isfinite(message.nis):
            self._used.append((*message.innovation, message.nis))

    def values(self) -> dict[str, Any]:
        x, y, turn, nis = np.array(self._used).T if self._used else np.full((4, 1), np.nan)
        return {
            "fixes": self._counts,
            "fix_innovation_position_rms_mm": 1e3 * math.sqrt(np.mean(x**2 + y**2)),
            "fix_innovation_heading_rms_deg": math.degrees(math.sqrt(np.mean(turn**2))),
            "fix_nis_mean": float(np.mean(nis)),
        }


GAUGES = (
    GaugeRow(40, PoseGauge),
    GaugeRow(90, FixesGauge),
    GaugeRow(100, InnovationGauge),
    GaugeRow(120, UnusedGauge),
)
FIGURES = (FixFigure,)
