"""What people are shown of valves learned in flight: a row of the view, numbers of the report."""

import math
from typing import Any

from groundstation.declarations.message import Message
from groundstation.declarations.view import NOTHING, Cell, Figure, Gauge, Level, Newest, cell
from groundstation.parts.supervision.messages import ValvesLearned

FAR_OFF_SIGMAS, FAR_OFF = 3.0, 0.1
"""A valve that is surely so far from the rig's thrust is worth a look."""


class LearnedGauge(Gauge):
    """Thrust of each valve over the rig's, in percent; the valve that is known worst says how well."""

    label = "thrust, learned"
    newest = (ValvesLearned,)

    def cell(self, newest: Newest, now_ns: int) -> Cell:
        del now_ns
        learned = newest.get(ValvesLearned)
        if learned is None:
            return NOTHING
        pairs = list(zip(learned.thrust_over_mass_ratio, learned.thrust_over_mass_sigma, strict=True))
        known = [sigma for _, sigma in pairs if math.isfinite(sigma)]
        if not known:
            return NOTHING
        shown = Cell()
        for ratio, sigma in pairs:
            off = abs(ratio - 1.0) - FAR_OFF > FAR_OFF_SIGMAS * sigma
            text = "? " if math.isnan(ratio) else f"{100.0 * ratio:.0f} "
            shown += cell(text, Level.WARNING if off else Level.PLAIN)
        return shown + cell(f"% ± {100.0 * max(known):.1f}")


class LearnedFigure(Figure):
    """What was known of each valve at the end."""

    inputs = (ValvesLearned,)

    def __init__(self) -> None:
        self._last: ValvesLearned | None = None

    def take(self, message: Message, t_s: float) -> None:
        del t_s
        assert isinstance(message, ValvesLearned)
        self._last = message

    def values(self) -> dict[str, Any]:
        last = self._last
        if last is None:
            return {}
        columns = {
            "thrust_over_mass_ratio": last.thrust_over_mass_ratio,
            "thrust_over_mass_sigma": last.thrust_over_mass_sigma,
            "torque_over_inertia_ratio": last.torque_over_inertia_ratio,
            "torque_over_inertia_sigma": last.torque_over_inertia_sigma,
            "dead_time_s": last.dead_time_s,
            "dead_time_sigma_s": last.dead_time_sigma_s,
            "open_s": last.open_s,
        }
        rows = [
            {"valve": valve, **{name: _known(values[valve]) for name, values in columns.items()}}
            for valve in range(len(last.open_s))
        ]
        return {"valves_learned": rows}


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
