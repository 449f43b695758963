"""The catalogue of ceiling LEDs: where each star is, and how well that is known."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import CalibrationFileError

MIN_STARS = 4
"""Below this no frame could be identified without a prior."""

_TWIN_M = 1e-3  # two stars nearer than this are one star written down twice


@dataclass(frozen=True, slots=True, eq=False)
class StarCatalogue:
    """Ceiling LEDs in ceiling coordinates (= table x, y carried straight up).

    Attributes:
        ids: Names of the stars as written in the file.
        x_m: Positions, shape (n,), m.
        y_m: Positions, shape (n,), m.
        std_m: Standard deviation per axis, shape (n,), m; 0 where the file does not say.
    """

    ids: tuple[str, ...]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    std_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        n = len(self.ids)
        if self.x_m.shape != (n,) or self.y_m.shape != (n,) or self.std_m.shape != (n,):
            raise ValueError("ids, x_m, y_m and std_m must have one entry per star")
        if n < MIN_STARS:
            raise ValueError(f"a catalogue needs at least {MIN_STARS} stars, this one has {n}")
        if not (np.isfinite(self.x_m).all() and np.isfinite(self.y_m).all()):
            raise ValueError("a star's position is not a finite number")
        if not (np.isfinite(self.std_m).all() and (self.std_m >= 0.0).all()):
            raise ValueError("a star's standard deviation is not a number of zero or more")
        seen: set[str] = set()
        for name in self.ids:
            if name in seen:
                raise ValueError(f"star id '{name}' appears twice")
            seen.add(name)
        twins = _twins(self.x_m, self.y_m)
        if twins is not None:
            raise ValueError(f"stars '{self.ids[twins[0]]}' and '{self.ids[twins[1]]}' are in one place")

    def __len__(self) -> int:
        return len(self.ids)

    @classmethod
    def from_positions(cls, position_ceiling_m: NDArray[np.float64]) -> "StarCatalogue":
        """Make a catalogue of numbered, exactly known stars from an array (n, 2) in m."""
        position = np.asarray(position_ceiling_m, dtype=np.float64).reshape(-1, 2)
        return cls(
            tuple(str(i) for i in range(len(position))),
            position[:, 0].copy(),
            position[:, 1].copy(),
            np.zeros(len(position)),
        )

    @classmethod
    def load(cls, path: Path | str) -> "StarCatalogue":
        """Read ``ceiling.csv``: ``id,x_m,y_m`` and, from a survey, ``std_x_m,std_y_m``.

        Raises:
            CalibrationFileError: The file is missing, or a column or a value of it is wrong.
        """
        path = Path(path)
        try:
            with path.open(newline="", encoding="utf-8") as file:
                rows = list(csv.reader(file))
        except OSError as error:
            raise CalibrationFileError(f"{path}: cannot be read ({error.strerror or error}).") from error
        except (UnicodeDecodeError, csv.Error) as error:
            raise CalibrationFileError(f"{path}: is not a CSV text file.") from error
        if not rows:
            raise CalibrationFileError(f"{path}: is empty; expected the header id,x_m,y_m.")
        header = [name.strip() for name in rows[0]]
        for name in ("id", "x_m", "y_m"):
            if name not in header:
                raise CalibrationFileError(f"{path}: column '{name}' is missing from its header.")
        ids: list[str] = []
        values: list[tuple[float, float, float]] = []
        for line, row in enumerate(rows[1:], start=2):
            if not row:
                continue
            if len(row) != len(header):
                raise CalibrationFileError(
                    f"{path}: line {line} has {len(row)} columns, expected {len(header)}."
                )
            fields = dict(zip(header, row, strict=True))
            std = [_value(path, line, fields, name) for name in ("std_x_m", "std_y_m") if name in fields]
            ids.append(fields["id"].strip())
            x, y = _value(path, line, fields, "x_m"), _value(path, line, fields, "y_m")
            values.append((x, y, math.sqrt(sum(s * s for s in std) / len(std)) if std else 0.0))
        table = np.array(values, dtype=np.float64).reshape(-1, 3)
        try:
            return cls(tuple(ids), table[:, 0].copy(), table[:, 1].copy(), table[:, 2].copy())
        except ValueError as error:
            raise CalibrationFileError(f"{path}: {error}.") from error


def _value(path: Path, line: int, fields: dict[str, str], name: str) -> float:
    try:
        value = float(fields[name])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise CalibrationFileError(f"{path}: line {line}, {name} is '{fields[name]}', expected a number.")
    return value


def _twins(x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> tuple[int, int] | None:
    """Find two stars in one place: neighbours after sorting by x within a millimetre."""
    order = np.lexsort((y_m, x_m))
    for step in range(1, len(order)):
        first, second = order[:-step], order[step:]
        near_x = x_m[second] - x_m[first] < _TWIN_M
        if not near_x.any():
            return None
        both = near_x & (np.abs(y_m[second] - y_m[first]) < _TWIN_M)
        if both.any():
            where = int(np.flatnonzero(both)[0])
            return int(first[where]), int(second[where])
    return None
