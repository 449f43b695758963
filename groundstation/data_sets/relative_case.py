"""The case of a relative-navigation data set: camera, points, inertia, first guess; JSON or TOML.

Keys: ``camera`` (``f_px cx cy width height``) and ``points_m``; optional ``sigma_px``, ``labelled``,
``inertia``, ``guess_frame0`` (``q``, scalar first, and ``t``), ``centre_of_mass_m``, ``eps_px``,
``tip_diameter_m``, ``markers``, ``orbit`` (``rate_rad_s``, ``camera_from_orbital_q``, ``camera_offset_m``).
Other keys are left to others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.json_file import parse_json
from groundstation.files.reading import read_bytes
from groundstation.files.toml_file import parse_toml
from groundstation.files.values import check_amount, number, numbers, whole_number
from groundstation.relative_navigation.hypotheses import MOST
from groundstation.relative_navigation.motion import CameraCraft
from groundstation.relative_navigation.pinhole import PinholeCamera
from groundstation.relative_navigation.pose import Pose
from groundstation.relative_navigation.rotations import matrix_of
from groundstation.relative_navigation.target import Target
from groundstation.relative_navigation.tracker_settings import TrackerSettings

Floats = NDArray[np.float64]

LEAST_SIGMA_PX = 1e-4
"""A case without noise is still written with so many digits."""
MOST_SIGMA_PX = 100.0
DEFAULT_SIGMA_PX = 0.3
MOST_DIAMETER_M = 10.0
"""Of a tip."""
MOST_RATE_RAD_S = 0.01
"""Of an orbit: no body has a faster one but close to something dense."""
_UNIT = 1e-3


@dataclass(frozen=True, slots=True, eq=False)
class RelativeCase:
    """A case.

    Attributes:
        settings: For a tracker.
        sigma_px: Of centres that come without a covariance.
        labelled: Whether the data say which point a centre is.
        tip_diameter_m: Of the points; None where nothing is known.
        raw: The whole file, for what only some commands want.
    """

    settings: TrackerSettings
    sigma_px: float
    labelled: bool
    tip_diameter_m: float | None
    raw: Mapping[str, Any]


def load_case(path: Path) -> RelativeCase:
    """Read a case; ``.toml`` is read as TOML, anything else as JSON.

    Raises:
        FileError: The file is missing or no case; the message names the key.
    """
    data = read_bytes(path)
    found = parse_toml(data, path) if path.suffix.lower() == ".toml" else parse_json(data, path)
    try:
        return case_of(found)
    except ValueError as error:
        raise FileError(f"{path}: {error}.") from error


def case_of(found: Mapping[str, Any]) -> RelativeCase:
    """Return the case of a tree of keys.

    Raises:
        ValueError: A key is missing or wrong; the message names it.
    """
    sigma = number(found, "sigma_px") if "sigma_px" in found else DEFAULT_SIGMA_PX
    if not 0.0 <= sigma <= MOST_SIGMA_PX:
        raise ValueError(f"sigma_px is {sigma:g}, expected 0 to {MOST_SIGMA_PX:g}")
    labelled = found.get("labelled", False)
    if not isinstance(labelled, bool):
        raise ValueError(f"labelled must be true or false, found {labelled!r}")
    diameter = None
    if "tip_diameter_m" in found:
        diameter = number(found, "tip_diameter_m")
        if not 0.0 < diameter <= MOST_DIAMETER_M:
            raise ValueError(f"tip_diameter_m is {diameter:g}, expected above 0 to {MOST_DIAMETER_M:g}")
    reach = None
    if "eps_px" in found:
        reach = number(found, "eps_px")
        if not 0.0 < reach <= 1e5:
            raise ValueError(f"eps_px is {reach:g}, expected above 0")
    settings = TrackerSettings(camera_of(found), _target(found), _guess(found), reach, _craft(found))
    if not labelled and not found.get("markers"):
        _check_turns(settings.target)
    return RelativeCase(settings, max(sigma, LEAST_SIGMA_PX), labelled, diameter, found)


def camera_of(found: Mapping[str, Any]) -> PinholeCamera:
    """Return the camera of a case.

    Raises:
        ValueError: It is missing or wrong.
    """
    camera = _table(found, "camera")
    for key, value in camera.items():
        if key.startswith("dist") and np.any(np.asarray(value, dtype=np.float64)):
            raise ValueError(f"camera.{key}: pictures must be free of distortion, rectify them first")
    try:
        return PinholeCamera(
            number(camera, "f_px"),
            number(camera, "cx"),
            number(camera, "cy"),
            whole_number(camera, "width"),
            whole_number(camera, "height"),
        )
    except ValueError as error:
        raise ValueError(f"camera: {error}") from error


def _target(found: Mapping[str, Any]) -> Target:
    points = found.get("points_m")
    if points is None:
        raise ValueError("key 'points_m' is missing")
    if not isinstance(points, list) or not points:
        raise ValueError("points_m must be a list of points, each x, y, z")
    rows = [numbers({"points_m": row}, "points_m", 3, f"points_m[{i}]") for i, row in enumerate(points)]
    inertia = np.array(numbers(found, "inertia", 3)) if found.get("inertia") is not None else None
    offset = np.array(numbers(found, "centre_of_mass_m", 3)) if "centre_of_mass_m" in found else None
    return Target(np.array(rows), inertia, offset)


def _check_turns(target: Target) -> None:
    alike = 1 + len(target.symmetries)
    if alike > MOST:
        raise ValueError(
            f"points_m look the same after {alike - 1} turns, and at most {MOST} poses that look alike are "
            "followed: move a point, or tell points apart (labelled, or markers of several colours)"
        )


def _guess(found: Mapping[str, Any]) -> Pose | None:
    if found.get("guess_frame0") is None:
        return None
    guess = _table(found, "guess_frame0")
    q = np.array(numbers(guess, "q", 4, "guess_frame0.q"))
    t = np.array(numbers(guess, "t", 3, "guess_frame0.t"))
    if abs(float(np.linalg.norm(q)) - 1.0) > 0.05:
        raise ValueError(f"guess_frame0.q must have the length 1, found {np.linalg.norm(q):g}")
    if not t[2] > 0.0:
        raise ValueError(f"guess_frame0.t must lie in front of the camera, found z = {t[2]:g}")
    return Pose(matrix_of(q), t)


def _craft(found: Mapping[str, Any]) -> CameraCraft:
    if "orbit" not in found:
        return CameraCraft()
    orbit = _table(found, "orbit")
    rate = number(orbit, "rate_rad_s", "orbit.rate_rad_s")
    if not rate >= 0.0:
        raise ValueError(f"orbit.rate_rad_s is {rate:g}, expected 0 or more")
    check_amount("orbit.rate_rad_s", rate, MOST_RATE_RAD_S, "is it in degrees?")
    q = np.array(numbers(orbit, "camera_from_orbital_q", 4, "orbit.camera_from_orbital_q"))
    if abs(float(np.linalg.norm(q)) - 1.0) > _UNIT:
        raise ValueError(f"orbit.camera_from_orbital_q must have the length 1, found {np.linalg.norm(q):g}")
    offset = np.zeros(3)
    if "camera_offset_m" in orbit:
        offset = np.array(numbers(orbit, "camera_offset_m", 3, "orbit.camera_offset_m"))
    rotation = matrix_of(q)
    return CameraCraft(rate, lambda _t_s: rotation, offset)


def _table(found: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    if key not in found:
        raise ValueError(f"key '{key}' is missing")
    if not isinstance(found[key], dict):
        raise ValueError(f"{key} must be a table of keys")
    table: Mapping[str, Any] = found[key]
    return table
