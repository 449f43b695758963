"""How the pictures of a case are looked at: its keys ``method``, ``level``, ``antennas``, ``markers``.

``antennas = [0, 1]`` names the points that are the left and the right end of the longest outline, with
``antenna_rule = "x"`` (published) or ``"own"``. ``[[markers]]`` name a point by its colour: ``point`` and
``hue_deg`` (red 0, green 120, blue 240), or ``point`` and ``clicked`` (rows of blue, green, red, 0 to 255).
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.data_sets.relative_case import RelativeCase
from groundstation.files.errors import FileError
from groundstation.files.values import number, numbers, whole_number
from groundstation.relative_navigation.centres import DEFAULT, METHODS
from groundstation.relative_navigation.colours import ColourTest, train
from groundstation.relative_navigation.spots import ANTENNA_RULES, SpotSettings


def looks_of(case: RelativeCase, path: Path) -> SpotSettings:
    """Return how to look at the pictures of a case.

    Raises:
        FileError: A key is wrong; the message names it.
    """
    try:
        return _looks(case.raw, len(case.settings.target))
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error


def _looks(found: Mapping[str, Any], count: int) -> SpotSettings:
    method = found.get("method", DEFAULT)
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, found {method!r}")
    level = number(found, "level") if "level" in found else None
    if level is not None and not 0.0 < level <= 1.0:
        raise ValueError(f"level is {level:g}, expected above 0 to 1")
    antennas = None
    if "antennas" in found:
        one, other = (int(x) for x in numbers(found, "antennas", 2))
        if not (0 <= one < count and 0 <= other < count and one != other):
            raise ValueError(f"antennas must name two of the {count} points")
        antennas = (one, other)
    rule = found.get("antenna_rule", "x")
    if rule not in ANTENNA_RULES:
        raise ValueError(f"antenna_rule must be one of {', '.join(ANTENNA_RULES)}, found {rule!r}")
    points, tests, hues = _markers(found, count)
    return SpotSettings(
        method=method,
        level=level,
        antennas=antennas,
        antenna_rule=rule,
        colour_points=points,
        colour_tests=tests,
        hues_deg=hues,
    )


def _markers(
    found: Mapping[str, Any], count: int
) -> tuple[tuple[int, ...], tuple[ColourTest, ...], tuple[float, ...]]:
    rows = found.get("markers", [])
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ValueError("markers must be tables [[markers]] with point and hue_deg or clicked")
    points: list[int] = []
    tests: list[ColourTest] = []
    hues: list[float] = []
    for i, row in enumerate(rows):
        point = whole_number(row, "point")
        if not 0 <= point < count or point in points:
            raise ValueError(f"markers[{i}].point is {point}, expected one of the {count} points, each once")
        points.append(point)
        if "clicked" in row:
            clicks = [numbers({"c": each}, "c", 3, f"markers[{i}].clicked") for each in row["clicked"]]
            tests.append(train(np.clip(np.array(clicks), 0, 255).astype(np.uint8)))
        else:
            hues.append(number(row, "hue_deg", f"markers[{i}].hue_deg"))
    if tests and hues:
        raise ValueError("markers must all have clicked, or all hue_deg")
    return tuple(points), tuple(tests), tuple(hues)
