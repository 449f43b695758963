"""``groundstation ranges``: what range finders measured in a recording."""

import math
from pathlib import Path
from typing import Annotated

import typer

from groundstation.recording.reader import Recording
from range_finder.messages import Range


def ranges(file: Annotated[Path, typer.Argument(help="Recording (.mcap).")]) -> None:
    """Print for each vehicle how many distances were measured, and between which limits.

    Example: groundstation ranges run.mcap
    """
    found: dict[str, list[float]] = {}
    with Recording(file) as recording:
        for message in recording.messages((Range,)):
            payload = message.payload
            assert isinstance(payload, Range)
            found.setdefault(payload.vehicle, []).append(payload.distance_m)
    for vehicle, distances_m in found.items():
        echoes_m = [distance_m for distance_m in distances_m if not math.isnan(distance_m)]
        limits = f"{min(echoes_m):.3f} to {max(echoes_m):.3f} m" if echoes_m else "no echo at all"
        print(f"{vehicle}: {len(distances_m)} measurements, {limits}")
    if not found:
        print("no range finder was recorded")
