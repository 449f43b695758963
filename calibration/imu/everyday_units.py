"""Results in the units that data sheets and people use, beside SI."""

from __future__ import annotations

import math
from collections.abc import Mapping

from calibration.result import Quantity, quantity_lines

G_M_S2 = 9.80665
"""Standard gravity."""
DEG = math.degrees(1.0)

EVERYDAY: Mapping[str, tuple[tuple[float, str], ...]] = {
    "rad/s": ((DEG, "deg/s"), (3600.0 * DEG, "deg/h")),
    "m/s^2": ((1e3 / G_M_S2, "mg"),),
    "rad/s sqrt(s)": ((DEG, "deg/s/sqrt(Hz)"), (60.0 * DEG, "deg/sqrt(h)")),
    "m/s^2 sqrt(s)": ((1e6 / G_M_S2, "ug/sqrt(Hz)"), (60.0, "m/s/sqrt(h)")),
    "rad/s/C": ((DEG, "deg/s/C"),),
    "m/s^2/C": ((1e3 / G_M_S2, "mg/C"),),
}
"""Factor and unit, for each SI unit."""


def everyday(value: float, unit: str) -> str:
    """Return a value in the units that people use; empty for a unit that is one of these."""
    return ", ".join(f"{factor * value:.4g} {name}" for factor, name in EVERYDAY.get(unit, ()))


def lines_of(quantities: Mapping[str, Quantity]) -> list[str]:
    """Return quantities in words, a line each, in SI and in everyday units."""
    lines = []
    for line, quantity in zip(quantity_lines(quantities), quantities.values(), strict=True):
        other = everyday(quantity.value, quantity.unit)
        lines.append(f"{line} ({other})" if other else line)
    return lines
