"""Whether residuals depend on where in the picture they are: what is left of a lens that is wrong.

Good residuals are noise, and their means over cells of the picture go to zero. A wrong lens pushes all
stars of a cell the same way. The cells' means are tested against their noise (chi-square), and what
they hold beyond it is the systematic part, in pixels per axis.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

_COLUMNS, _ROWS = 8, 6
_MIN_IN_CELL = 6
_CHANCE = 1e-6
_SHARE = 0.3  # of the noise: less than this does no harm that anybody would see


@dataclass(frozen=True, slots=True, eq=False)
class ResidualStructure:
    """Means of residuals over the cells of a picture.

    Attributes:
        centre_px: Middles of the cells that hold enough residuals, shape (k, 2).
        mean_px: Their mean residuals, shape (k, 2).
        systematic_px: Root mean square per axis of what the means hold beyond their noise.
        noise_px: Root mean square per axis of the residuals about the means.
        chance: How probable such means are if there is nothing but noise.
    """

    centre_px: NDArray[np.float64]
    mean_px: NDArray[np.float64]
    systematic_px: float
    noise_px: float
    chance: float

    @property
    def is_wrong(self) -> bool:
        """Whether the camera's model does not fit: sure, and large enough to matter."""
        return self.chance < _CHANCE and self.systematic_px > _SHARE * self.noise_px


def find_structure(
    pixel: NDArray[np.float64], residual_px: NDArray[np.float64], width: int, height: int
) -> ResidualStructure:
    """Test residuals for structure over the picture.

    Args:
        pixel: Where each was observed, shape (m, 2).
        residual_px: Observed minus modelled, shape (m, 2), wild ones left out.
        width: Of the picture, px.
        height: Of the picture, px.
    """
    size = np.array([width / _COLUMNS, height / _ROWS])
    cell = np.clip(((pixel + 0.5) / size).astype(np.int64), 0, (_COLUMNS - 1, _ROWS - 1))
    flat = cell[:, 1] * _COLUMNS + cell[:, 0]
    count = np.bincount(flat, minlength=_COLUMNS * _ROWS)
    total = np.stack([np.bincount(flat, residual_px[:, i], _COLUMNS * _ROWS) for i in (0, 1)], axis=1)
    mean = total / np.maximum(count, 1)[:, None]
    rest = residual_px - mean[flat]
    held = count >= _MIN_IN_CELL
    freedom = 2.0 * max(int(count[held].sum() - held.sum()), 1)
    variance = max(float((rest[held[flat]] ** 2).sum()) / freedom, 1e-12)
    square = (mean[held] ** 2).sum(axis=1)
    statistic = float((count[held] * square).sum()) / variance
    excess = float((count[held] * 0.5 * square - variance).sum()) / max(int(count[held].sum()), 1)
    column, row = np.arange(_COLUMNS * _ROWS) % _COLUMNS, np.arange(_COLUMNS * _ROWS) // _COLUMNS
    centre = (np.stack((column, row), axis=1)[held] + 0.5) * size - 0.5
    return ResidualStructure(
        centre,
        mean[held],
        float(np.sqrt(max(excess, 0.0))),
        float(np.sqrt(variance)),
        float(chi2.sf(statistic, 2 * int(held.sum()))) if held.any() else 1.0,
    )
