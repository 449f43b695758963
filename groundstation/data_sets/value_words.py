"""What is wrong with the values of a folder's tables, in a sentence: lengths in mm, no temperatures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WIDEST_TABLE_M = 50.0
"""From the middle of the table frame; no vehicle glides farther away."""
CHIP_C = (-60.0, 150.0)
"""What a sensor can report of itself, with room."""
NAMED = 3


def complaint_about_places(stars: Array) -> str | None:
    """Return why the fixes' places cannot be metres; None if they can.

    Args:
        stars: (m, 5) exposure, arrival, x, y, heading.
    """
    places = np.abs(stars[:, 2:4]).max(axis=1, initial=0.0)
    places = places[np.isfinite(places)]
    if not len(places) or float(np.median(places)) <= WIDEST_TABLE_M:
        return None
    return (
        f"x_m and y_m are {np.median(places):.4g} in the middle, farther than any table reaches: in mm or "
        "cm? Metres are expected"
    )


def complaint_about_temperatures(temperature_c: Array) -> str | None:
    """Return why most temperatures cannot be degrees Celsius; None if they can, or if there are none."""
    known = temperature_c[np.isfinite(temperature_c)]
    if not len(known) or CHIP_C[0] <= float(np.median(known)) <= CHIP_C[1]:
        return None
    return (
        f"temperature_C is {np.median(known):.4g} in the middle, and no chip is so warm or cold: degrees "
        "Celsius are expected"
    )


def without_wild_temperatures(
    temperature_c: Array, lines: Sequence[int], name: str
) -> tuple[Array, tuple[str, ...]]:
    """Return the temperatures with NaN for those that no chip can have, and a sentence about these.

    Args:
        temperature_c: (n,) as given.
        lines: Of the rows, in their file.
        name: Of the file.
    """
    wild = np.flatnonzero((temperature_c < CHIP_C[0]) | (temperature_c > CHIP_C[1]))
    if not len(wild):
        return temperature_c, ()
    kept = temperature_c.copy()
    kept[wild] = np.nan
    where = ", ".join(f"{lines[row]} ({temperature_c[row]:.6g})" for row in wild[:NAMED].tolist())
    more = f" and {len(wild) - NAMED} more" if len(wild) > NAMED else ""
    word = "lines" if len(wild) > 1 else "line"
    return kept, (
        f"{name}: {len(wild)} of {len(kept)} temperatures set aside, temperature_C is none of a chip: {word} "
        f"{where}{more}",
    )
