"""The catalogue of ceiling LEDs: where each star is, and how well that is known."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.number_tables import parse_table
from groundstation.files.reading import read_bytes

MIN_STARS = 4
"""Below this no frame could be identified without a prior."""

_PLACE, _SPREAD = ("x_m", "y_m"), ("std_x_m", "std_y_m")
_TWIN_M = 1e-3  # two stars nearer than this are one star written down twice


@dataclass(frozen=True, slots=True, eq=False)
class StarCatalogue:
    """Ceiling LEDs in ceiling coordinates (= table x, y carried straight up).

    Attributes:
        ids: Names of the stars as written in the file.
        x_m: Positions, shape (n,), m.
        y_m: Positions, shape (n,), m.
        sigma_m: Standard deviation per axis, shape (n,), m; 0 where the file does not state it.
    """

    ids: tuple[str, ...]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    sigma_m: NDArray[np.float64]

    def __post_init__(self) -> None:
        n = len(self.ids)
        if self.x_m.shape != (n,) or self.y_m.shape != (n,) or self.sigma_m.shape != (n,):
            raise ValueError("ids, x_m, y_m and sigma_m must have one entry per star")
        if n < MIN_STARS:
            raise ValueError(f"a catalogue needs at least {MIN_STARS} stars, this one has {n}")
        if not (np.isfinite(self.x_m).all() and np.isfinite(self.y_m).all()):
            raise ValueError("a star's position is not a finite number")
        if not (np.isfinite(self.sigma_m).all() and (self.sigma_m >= 0.0).all()):
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
            FileError: The file is missing, or a column or a value of it is wrong.
        """
        return cls.parse(read_bytes(Path(path)), Path(path))

    @classmethod
    def parse(cls, data: bytes, path: Path) -> "StarCatalogue":
        """Read the content of ``ceiling.csv``.

        Raises:
            FileError: A column or a value of it is wrong.
        """
        table = parse_table(data, path, (*_PLACE, *_SPREAD), ("id",), optional=_SPREAD, unique=("id",))
        x_m, y_m, *spread = (column.copy() for column in table.numbers.T)
        given = [sigma for sigma in spread if not np.isnan(sigma).all()]
        sigma_m = np.sqrt(np.mean(np.square(given), axis=0)) if given else np.zeros(len(x_m))
        try:
            return cls(tuple(table.words["id"]), x_m, y_m, sigma_m)
        except ValueError as error:
            raise FileError(f"{path}: {error}.") from error


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
