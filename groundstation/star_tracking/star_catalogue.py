"""The catalogue of ceiling LEDs: where each star is, and how well that is known."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.files.errors import FileError
from groundstation.files.number_tables import parse_table
from groundstation.files.reading import read_bytes
from groundstation.star_tracking.camera_model import CameraCalibration

MIN_STARS = 4
"""Below this no frame could be identified without a prior."""
MOST_STARS = 5000
"""With more the tables over the sky take minutes and gigabytes, and no ceiling has so many lights."""

_PLACE, _SPREAD = ("x_m", "y_m"), ("std_x_m", "std_y_m")
FARTHEST_M = 100.0
"""No ceiling reaches so far from the table's origin: beyond it a list is in millimetres."""
_LARGEST_SIGMA_M = 10.0
_WIDEST_M = 60.0  # the tables over the sky grow with its area
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
        if n > MOST_STARS:
            raise ValueError(f"a catalogue may have {MOST_STARS} stars at most, this one has {n}")
        flaw = _flaw(self.ids, self.x_m, self.y_m, self.sigma_m)
        if flaw is not None:
            raise ValueError(flaw[1])

    def __len__(self) -> int:
        return len(self.ids)

    def check_in_view(self, camera: CameraCalibration, where: str) -> None:
        """Refuse a list of which no picture can show enough: it is in other units than the camera's file.

        Args:
            camera: That is to see the stars.
            where: Begins the sentence.

        Raises:
            ValueError: It is one.
        """
        from scipy.spatial import cKDTree  # every process reads rigs, and few look for neighbours

        half = 0.5 * np.array([camera.width / camera.fx, camera.height / camera.fy])
        reach_m = 2.0 * float(np.hypot(*half)) * camera.ceiling_height_above_camera_m
        place_m = np.stack((self.x_m, self.y_m), axis=1)
        found = cKDTree(place_m).query(place_m, k=MIN_STARS)
        apart_m = float(np.asarray(found[0])[:, -1].min())
        if apart_m > reach_m:
            raise ValueError(
                f"{where}: no {MIN_STARS} stars are nearer than {apart_m:.3g} m to each other, "
                f"a picture shows {reach_m:.3g} m of the ceiling: is the list in m?"
            )

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
        table = parse_table(
            data,
            path,
            (*_PLACE, *_SPREAD),
            ("id",),
            optional=_SPREAD,
            unique=("id",),
            most=dict.fromkeys(_PLACE, FARTHEST_M) | dict.fromkeys(_SPREAD, _LARGEST_SIGMA_M),
        )
        if len(table.numbers) > MOST_STARS:
            raise FileError(
                f"{path}: lists {len(table.numbers)} stars, expected {MOST_STARS} at most: keep those that "
                "the camera can see."
            )
        for row in np.flatnonzero((table.numbers[:, len(_PLACE) :] < 0.0).any(axis=1)):
            raise FileError(f"{path}: line {table.lines[row]}: a standard deviation is below zero.")
        x_m, y_m, *spread = (column.copy() for column in table.numbers.T)
        given = [sigma for sigma in spread if not np.isnan(sigma).all()]
        sigma_m = np.sqrt(np.mean(np.square(given), axis=0)) if given else np.zeros(len(x_m))
        ids = tuple(table.words["id"])
        flaw = _flaw(ids, x_m, y_m, sigma_m)
        if flaw is not None:
            raise FileError(f"{path}: line {table.lines[flaw[0]]}: {flaw[1]}.")
        try:
            return cls(ids, x_m, y_m, sigma_m)
        except ValueError as error:
            raise FileError(f"{path}: {error}.") from error


def _flaw(
    ids: tuple[str, ...],
    x_m: NDArray[np.float64],
    y_m: NDArray[np.float64],
    sigma_m: NDArray[np.float64],
) -> tuple[int, str] | None:
    """Find what is wrong with a list: row and sentence."""
    place_m = np.stack((x_m, y_m), axis=1)
    for row in np.flatnonzero(~np.isfinite(place_m).all(axis=1)):
        return int(row), "a star's position is not a finite number"
    for row in np.flatnonzero(~(np.isfinite(sigma_m) & (sigma_m >= 0.0))):
        return int(row), "a star's standard deviation is not a number of zero or more"
    if len(ids) and np.ptp(place_m, axis=0).max() > _WIDEST_M:
        away_m = np.abs(place_m - np.median(place_m, axis=0)).max(axis=1)
        far = int(np.argmax(away_m))
        return far, f"star '{ids[far]}' lies {away_m[far]:.4g} m from the middle of the others (a typo?)"
    first: dict[str, int] = {}
    for place, name in enumerate(ids):
        if first.setdefault(name, place) != place:
            return place, f"star id '{name}' appears twice"
    twins = _twins(x_m, y_m)
    if twins is not None:
        return twins[1], f"stars '{ids[twins[0]]}' and '{ids[twins[1]]}' are in one place"
    return None


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
