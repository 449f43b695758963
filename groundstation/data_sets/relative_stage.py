"""A stage in regular precession and the runs that show it: STAGE.json and ``run,t,marker,u,v``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.json_file import parse_json
from groundstation.files.number_tables import load_table
from groundstation.files.reading import read_bytes
from groundstation.files.values import number, numbers
from groundstation.relative_navigation.precession import AxialInertia
from groundstation.relative_navigation.stage_spin import LeavingCamera, Stage, StageRun
from groundstation.relative_navigation.target import MOST_POINTS, check_points

Floats = NDArray[np.float64]

COLUMNS = ("run", "t", "marker", "u", "v")
LEAST_SIGMA_PX, MOST_SIGMA_PX = 1e-6, 100.0
"""Of pixels: none is without any error, and a rate made of pixels without one would have no sigma."""
_PLACE = re.compile(r"at \(\s*([-+.\deE]+)\s*\+\s*([.\deE]*)\s*\*?\s*t\s*,\s*0\s*,\s*0\s*\)")
"""How a file words a camera that leaves: ``at (2+t,0,0)``, ``at (0.5+0.3*t,0,0)``."""


@dataclass(frozen=True, slots=True, eq=False)
class StageCase:
    """A stage file.

    Attributes:
        stage: What is known.
        sigma_px: Of the pixels; by the name of the runs' file where the file has several.
        truth_rad_s: The rate, body axes, (3,), where the file has it; for statistics only.
    """

    stage: Stage
    sigma_px: float
    truth_rad_s: Floats | None


def load_stage(path: Path, runs: Path) -> StageCase:
    """Read a stage file for a file of runs.

    Raises:
        FileError: It is missing, or a key is missing or wrong.
    """
    found = parse_json(read_bytes(path), path)
    try:
        inertia = AxialInertia(number(found, "Ix"), number(found, "In"))
        stage = Stage(inertia, _markers(found), _camera(found))
        truth = None
        if found.get("omega_deg_s") is not None:
            truth = np.radians(numbers(found, "omega_deg_s", 3))
        return StageCase(stage, _sigma(found, runs), truth)
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error


def _markers(found: Mapping[str, Any]) -> Floats:
    rows = found.get("markers_m")
    if not isinstance(rows, list) or len(rows) < 3:
        raise ValueError("markers_m must be a list of at least three points, each x, y, z")
    if len(rows) > MOST_POINTS:
        raise ValueError(f"markers_m holds {len(rows)} points, expected at most {MOST_POINTS}")
    markers = np.array([numbers({"m": row}, "m", 3, f"markers_m[{i}]") for i, row in enumerate(rows)])
    check_points(markers, "markers_m")
    return markers


def _camera(found: Mapping[str, Any]) -> LeavingCamera:
    f_px = number(found, "f_px")
    if "camera_start_m" in found:
        return LeavingCamera(f_px, number(found, "camera_start_m"), number(found, "camera_speed_m_s"))
    words = found.get("camera")
    place = _PLACE.search(words) if isinstance(words, str) else None
    if place is None:
        raise ValueError(
            "camera must tell where the camera is, as 'at (2+t,0,0) m', or give camera_start_m and "
            "camera_speed_m_s"
        )
    try:
        start_m, speed_m_s = float(place[1]), float(place[2] or 1.0)
    except ValueError as error:
        raise ValueError(f"camera: no numbers in '{place[0]}'") from error
    return LeavingCamera(f_px, start_m, speed_m_s)


def _sigma(found: Mapping[str, Any], runs: Path) -> float:
    given = found.get("sigma_px", 1.0)
    if isinstance(given, dict):
        if runs.stem in given:
            return _positive(number(given, runs.stem, f"sigma_px.{runs.stem}"))
        return _positive(max(number(given, key, f"sigma_px.{key}") for key in given)) if given else 1.0
    return _positive(number({"sigma_px": given}, "sigma_px"))


def _positive(sigma: float) -> float:
    if not LEAST_SIGMA_PX <= sigma <= MOST_SIGMA_PX:
        raise ValueError(f"sigma_px is {sigma:g}, expected {LEAST_SIGMA_PX:g} to {MOST_SIGMA_PX:g}")
    return sigma


def read_runs(path: Path, stage: Stage) -> dict[int, StageRun]:
    """Return the runs by number.

    Raises:
        FileError: A column or value is missing or wrong, or a run does not show enough.
    """
    table = load_table(path, COLUMNS, most={"u": 1e6, "v": 1e6, "t": 1e9, "run": 1e9})
    rows, lines = table.numbers, table.lines
    if not len(rows):
        raise FileError(f"{path}: holds no pixels.")
    odd = np.flatnonzero(
        (rows[:, 2] < 0) | (rows[:, 2] >= len(stage.markers_m)) | (rows[:, 2] != np.round(rows[:, 2]))
    )
    if len(odd):
        raise FileError(
            f"{path}: line {lines[odd[0]]}: marker {rows[odd[0], 2]:g} is none of the stage's "
            f"{len(stage.markers_m)} markers."
        )
    found: dict[int, StageRun] = {}
    for name in np.unique(rows[:, 0]).tolist():
        own = rows[rows[:, 0] == name]
        if len(np.unique(own[:, 1])) < 2 or len(own) < 6:
            raise FileError(f"{path}: run {name:g} shows fewer than two frames or six markers: no rate.")
        nearest_m = stage.camera.start_m + float((stage.camera.speed_m_s * own[:, 1]).min())
        reach_m = float(np.linalg.norm(stage.markers_m, axis=1).max())
        if not nearest_m > reach_m:
            raise FileError(
                f"{path}: run {name:g}: the camera is {nearest_m:g} m from the stage's middle, where markers "
                f"{reach_m:g} m from it may be behind it: check camera_start_m, camera_speed_m_s and t."
            )
        shown, times = np.unique(own[:, 1:3], axis=0, return_counts=True)
        if times.max() > 1:
            t_s, marker = shown[times.argmax()]
            raise FileError(f"{path}: run {name:g} shows marker {marker:g} twice at t = {t_s:g} s.")
        found[int(name)] = StageRun(own[:, 1], own[:, 2].astype(np.int64), own[:, 3:5])
    return found
