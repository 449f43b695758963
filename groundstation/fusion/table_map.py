"""The table map as calibration data: acceleration on a grid, its sigma, where it comes from."""

from __future__ import annotations

import hashlib
import io
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.reading import read_bytes
from groundstation.files.toml_file import parse_toml, toml_lines, toml_table
from groundstation.files.values import number, numbers, whole_number
from groundstation.files.writing import write_files

Array = NDArray[np.float64]

G_M_S2 = 9.80665
"""Standard gravity (3rd CGPM, 1901)."""
_ARRAYS = {
    "ax_m_s2": "ax_m_s2",
    "ay_m_s2": "ay_m_s2",
    "sigma_x_m_s2": "std_x_m_s2",
    "sigma_y_m_s2": "std_y_m_s2",
    "height_m": "height_m",
}
"""Arrays of a map, and their names in the file of its grid."""


@dataclass(frozen=True, slots=True)
class MapProvenance:
    """Where a map comes from."""

    made_utc: datetime
    recordings: dict[str, str]
    """SHA-256 by name."""
    residual_ratio: float
    """Chi-square of the flights' innovations over their number."""
    flown_s: float
    notes: dict[str, float | str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, eq=False)
class TableMap:
    """Acceleration of an unpushed vehicle over the table, table frame; arrays (rows over y, columns over x).

    It is what accelerometers do not feel: gravity along the surface. Between grid points it is bilinear;
    outside it is the mean slope, with `far_sigma_m_s2`.
    """

    x_min_m: float
    y_min_m: float
    step_m: float
    ax_m_s2: Array
    ay_m_s2: Array
    sigma_x_m_s2: Array
    sigma_y_m_s2: Array
    height_m: Array
    """Of the surface about the mean plane, mean zero."""
    mean_m_s2: tuple[float, float]
    """Average over the table."""
    mean_covariance_m2_s4: Array
    """(2, 2)."""
    far_sigma_m_s2: float
    """Sigma, per axis, where nothing is known but the mean slope."""
    provenance: MapProvenance

    def __post_init__(self) -> None:
        shape = self.ax_m_s2.shape
        if len(shape) != 2 or min(shape) < 2:
            raise ValueError(f"a map needs at least 2 x 2 grid points, found {shape}")
        for name in _ARRAYS:
            value = getattr(self, name)
            if value.shape != shape:
                raise ValueError(f"{name} is {value.shape}, ax_m_s2 is {shape}")
            if not np.isfinite(value).all():
                raise ValueError(f"{name} holds a number that is not finite")
        if not (math.isfinite(self.step_m) and self.step_m > 0.0):
            raise ValueError(f"step_m must be above zero, found {self.step_m}")

    @property
    def x_m(self) -> Array:
        """Grid lines along x."""
        return np.asarray(self.x_min_m + self.step_m * np.arange(self.ax_m_s2.shape[1]), dtype=np.float64)

    @property
    def y_m(self) -> Array:
        """Grid lines along y."""
        return np.asarray(self.y_min_m + self.step_m * np.arange(self.ax_m_s2.shape[0]), dtype=np.float64)

    @property
    def mean_gradient_rad(self) -> tuple[float, float]:
        """Mean uphill gradient (dh/dx, dh/dy)."""
        return -self.mean_m_s2[0] / G_M_S2, -self.mean_m_s2[1] / G_M_S2

    def acceleration_m_s2(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the acceleration (ax, ay) at one place; plain floats, for controllers and filters."""
        cell = self._cell(x_m, y_m)
        if cell is None:
            return self.mean_m_s2
        return self._between(self.ax_m_s2, *cell), self._between(self.ay_m_s2, *cell)

    def sigma_m_s2(self, x_m: float, y_m: float) -> tuple[float, float]:
        """Return the standard deviation of the acceleration at one place, per axis."""
        cell = self._cell(x_m, y_m)
        if cell is None:
            return self.far_sigma_m_s2, self.far_sigma_m_s2
        return self._between(self.sigma_x_m_s2, *cell), self._between(self.sigma_y_m_s2, *cell)

    def accelerations_m_s2(self, position_m: Array) -> Array:
        """Return the acceleration (n, 2) at positions (n, 2)."""
        found = [self.acceleration_m_s2(x, y) for x, y in position_m.tolist()]
        return np.array(found).reshape(-1, 2)

    def _cell(self, x_m: float, y_m: float) -> tuple[int, int, float, float] | None:
        rows, columns = self.ax_m_s2.shape
        u, v = (x_m - self.x_min_m) / self.step_m, (y_m - self.y_min_m) / self.step_m
        if not (0.0 <= u <= columns - 1.0 and 0.0 <= v <= rows - 1.0):
            return None
        i, j = min(int(u), columns - 2), min(int(v), rows - 2)
        return i, j, u - i, v - j

    @staticmethod
    def _between(grid: Array, i: int, j: int, u: float, v: float) -> float:
        low = (1.0 - u) * grid.item(j, i) + u * grid.item(j, i + 1)
        high = (1.0 - u) * grid.item(j + 1, i) + u * grid.item(j + 1, i + 1)
        return (1.0 - v) * low + v * high

    def save(self, path: Path) -> None:
        """Write `path` (TOML) and the grid beside it (`.npz`), both or none.

        Raises:
            FileError: the folder does not exist or may not be written.
        """
        write_files(self.files(path))

    def files(self, path: Path) -> dict[Path, bytes | str]:
        """Return what is written: `path` (TOML) and the grid beside it (`.npz`)."""
        memory = io.BytesIO()
        np.savez_compressed(
            memory, **{key: getattr(self, name) for name, key in _ARRAYS.items()}, allow_pickle=False
        )
        grid, grid_path = memory.getvalue(), path.with_suffix(".npz")
        text = self._text(grid_path.name, hashlib.sha256(grid).hexdigest())
        return {grid_path: grid, path: text}

    def _text(self, grid_name: str, grid_sha256: str) -> str:
        origin = self.provenance
        sigma = np.sqrt(self.mean_covariance_m2_s4.diagonal())
        lines = ["# Table map: what pulls an unpushed vehicle along the table, by place", ""]
        lines += toml_lines({"made_utc": origin.made_utc})
        lines += toml_table(
            "grid",
            {
                "file": grid_name,
                "sha256": grid_sha256,
                "x_min_m": self.x_min_m,
                "y_min_m": self.y_min_m,
                "step_m": self.step_m,
                "columns": self.ax_m_s2.shape[1],
                "rows": self.ax_m_s2.shape[0],
            },
        )
        mean = {"value": list(self.mean_m_s2), "std": sigma.tolist(), "unit": "m/s^2"}
        tilt = [self.mean_gradient_rad, (sigma / G_M_S2).tolist()]
        lines += toml_table("mean.acceleration", mean)
        lines += toml_table(
            "mean.covariance", {"value": self.mean_covariance_m2_s4.tolist(), "unit": "m^2/s^4"}
        )
        lines += toml_table("mean.uphill_gradient", {"value": tilt[0], "std": tilt[1], "unit": "rad"})
        lines += toml_table("unvisited_std", {"value": self.far_sigma_m_s2, "unit": "m/s^2"})
        lines += toml_table("residual.chi_square_ratio", {"value": origin.residual_ratio, "unit": "1"})
        lines += toml_table("flown", {"value": origin.flown_s, "unit": "s"})
        if origin.notes:
            lines += toml_table("notes", origin.notes)
        for name, sha256 in origin.recordings.items():
            lines += toml_table("recordings", {"name": name, "sha256": sha256}, is_row=True)
        return "\n".join(lines) + "\n"

    @classmethod
    def load(cls, path: Path) -> TableMap:
        """Read a map and its grid.

        Raises:
            FileError: One sentence with file and key.
        """
        return cls.parse(read_bytes(path), path)

    @classmethod
    def parse(cls, data: bytes, path: Path, read: Callable[[Path], bytes] = read_bytes) -> TableMap:
        """Read the content of a map.

        Args:
            data: Of the TOML.
            path: Its name; the grid lies beside it.
            read: Gives the content of the grid's file.

        Raises:
            FileError: One sentence with file and key.
        """
        text = parse_toml(data, path)
        try:
            return cls._from(text, _parse_grid(path, text, read))
        except FileError:
            raise
        except KeyError as error:
            raise FileError(f"{path}: key {error.args[0]} is missing.") from error
        except (ArithmeticError, AttributeError, IndexError, TypeError, ValueError) as error:
            raise FileError(f"{path}: {error!s:.200}.") from error

    @classmethod
    def _from(cls, text: dict[str, Any], grids: dict[str, Array]) -> TableMap:
        grid, mean = text["grid"], text["mean"]
        x_m_s2, y_m_s2 = numbers(mean["acceleration"], "value", 2, "mean.acceleration.value")
        rows = mean["covariance"]["value"]
        covariance = [numbers({"value": row}, "value", 2, "mean.covariance.value") for row in rows]
        shape = whole_number(grid, "rows"), whole_number(grid, "columns")
        if shape != grids["ax_m_s2"].shape:
            raise ValueError(f"its grid is {grids['ax_m_s2'].shape}, it states {shape}")
        return cls(
            x_min_m=number(grid, "x_min_m"),
            y_min_m=number(grid, "y_min_m"),
            step_m=number(grid, "step_m"),
            **grids,
            mean_m_s2=(x_m_s2, y_m_s2),
            mean_covariance_m2_s4=np.array(covariance).reshape(2, 2),
            far_sigma_m_s2=number(text["unvisited_std"], "value", "unvisited_std.value"),
            provenance=MapProvenance(
                text["made_utc"].astimezone(UTC),
                {row["name"]: row["sha256"] for row in text["recordings"]},
                number(text["residual"]["chi_square_ratio"], "value", "residual.chi_square_ratio.value"),
                number(text["flown"], "value", "flown.value"),
                dict(text.get("notes", {})),
            ),
        )


def _parse_grid(path: Path, text: dict[str, Any], read: Callable[[Path], bytes]) -> dict[str, Array]:
    """Read the arrays that a map's TOML names, and check that they are the ones it was written with."""
    grid_path = path.with_name(str(text["grid"]["file"]))
    try:
        data = read(grid_path)
    except FileError as error:
        raise FileError(f"{path}: its grid {error}") from error
    if hashlib.sha256(data).hexdigest() != text["grid"]["sha256"]:
        raise FileError(f"{grid_path} is not the grid that {path} was written with (SHA-256 differs).")
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        return {name: np.asarray(arrays[key], dtype=np.float64) for name, key in _ARRAYS.items()}
