"""Statistics of errors as the published table has them, beside honest ones.

Simakov, Ustyugov 2016, formulas (3), divide the sum of squares by n (n - 1): that is the variance of a mean,
were the errors counted from it. Its printed D is such a number; its M is probably a mean of absolute errors
(0.76, 0.83 and 0.79 of the rms, where a normal distribution gives 0.80).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class ErrorStatistics:
    """Of n errors, in their unit or its square.

    Attributes:
        count: n.
        mean: Published M by its formula.
        mean_absolute: What its printed M probably is.
        published_variance: Published D: sum of squares over n (n - 1).
        published_sigma: Root of it.
        variance: Of the sample, n - 1.
        sigma: Root of it.
        rms: Root of the mean square, bias included.
    """

    count: int
    mean: float
    mean_absolute: float
    published_variance: float
    published_sigma: float
    variance: float
    sigma: float
    rms: float


PUBLISHED_STAGE = {
    "x": (0.10, 3.5e-5, 0.012),
    "y": (0.20, 1.17e-4, 0.010),
    "z": (0.14, 6.3e-5, 0.021),
}
"""Table 1 of the publication: M deg/s, D deg^2/s^2, sigma deg/s of the three rates, 500 runs."""


def error_statistics(errors: NDArray[np.float64]) -> ErrorStatistics:
    """Return the statistics of errors (n,).

    Raises:
        ValueError: There are fewer than two.
    """
    count = len(errors)
    if count < 2:
        raise ValueError(f"statistics need at least two errors, found {count}")
    squares = float(errors @ errors)
    published = squares / (count * (count - 1))
    variance = float(errors.var(ddof=1))
    return ErrorStatistics(
        count,
        float(errors.mean()),
        float(np.abs(errors).mean()),
        published,
        math.sqrt(published),
        variance,
        math.sqrt(variance),
        math.sqrt(squares / count),
    )
