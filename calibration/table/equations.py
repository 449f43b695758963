"""The normal equations of flights: each flight's own unknowns eliminated, what is shared left over."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from calibration.outcome import CalibrationRefusedError
from calibration.table.chain import (
    BIAS,
    DELAY,
    LEVER,
    MATRIX,
    NUISANCES,
    REST,
    WARMTH,
    Field,
    innovations,
)
from calibration.table.flight_log import FlightLog

Array = NDArray[np.float64]

_ROWS_AT_ONCE = 512


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightPriors:
    """What is known of each flight's own unknowns before it: one sigma about zero."""

    bias_m_s2: float = 0.15
    bias_walk_m_s2_rts: float = 1.6e-5
    warmth_m_s2_k: float = 5e-4
    matrix: float = 1e-2
    rest_m_s2: float = 1e-4
    """Extra slope of a vehicle that stands: 0.01 mrad."""
    lever_m: float = 1e-3
    delay_s: float = 2e-3

    def variances(self) -> Array:
        """Return (NUISANCES,) in the order of the columns."""
        sigma = np.empty(NUISANCES)
        sigma[BIAS], sigma[WARMTH], sigma[MATRIX] = self.bias_m_s2, self.warmth_m_s2_k, self.matrix
        sigma[REST], sigma[LEVER], sigma[DELAY] = self.rest_m_s2, self.lever_m, self.delay_s
        return sigma**2


@dataclass(frozen=True, slots=True, eq=False)
class FlightEquations:
    """Least squares of one flight: information J and vector h of the slope (2) and the field's amplitudes.

    The flight's own unknowns u are already minimised over: u = own - response @ shared.
    """

    name: str
    information: Array
    """(2 + m, 2 + m)."""
    vector: Array
    """(2 + m,)."""
    power: float
    """Sum of squares of the whitened innovations that remains with slope and field zero."""
    rows: int
    own: Array
    """(NUISANCES,)."""
    response: Array
    """(NUISANCES, 2 + m)."""
    own_covariance: Array
    """(NUISANCES, NUISANCES) with slope and field known."""
    headings_rad: float
    """How far the heading turned while fixes were taken: largest less smallest."""
    duration_s: float
    centre_m: Array
    """(2,) mean place of the flight."""

    def scaled(self, variance_ratio: float) -> FlightEquations:
        """Return the same with all variances, those of its own unknowns' priors too, this much larger."""
        r = 1.0 / variance_ratio
        return replace(
            self, information=self.information * r, vector=self.vector * r, power=self.power * r,
            own_covariance=self.own_covariance * variance_ratio,
        )  # fmt: skip

    def unknowns(self, shared: Array, shared_covariance: Array) -> tuple[Array, Array]:
        """Return the flight's own unknowns (NUISANCES,) and their covariance."""
        value = self.own - self.response @ shared
        return value, self.own_covariance + self.response @ shared_covariance @ self.response.T


def flight_equations(log: FlightLog, field: Field, priors: FlightPriors) -> FlightEquations:
    """Turn a flight into normal equations.

    Raises:
        CalibrationRefusedError: fewer than five fixes, or nothing was flown.
    """
    size = NUISANCES + 2 + field.size
    J, h, power, rows = np.zeros((size, size)), np.zeros(size), 0.0, 0
    X, y = np.empty((_ROWS_AT_ONCE, size)), np.empty(_ROWS_AT_ONCE)
    filled = fixes = 0
    for innovation in innovations(log, field, priors.bias_walk_m_s2_rts):
        fixes += innovation.is_fix
        if innovation.covariance.trace() > 1.0:
            continue  # the first fix, which only states where the motion starts
        root = np.linalg.cholesky(innovation.covariance)
        white = solve_triangular(
            root, np.column_stack([innovation.value, innovation.columns]), lower=True, check_finite=False
        )
        X[filled : filled + 2], y[filled : filled + 2] = white[:, 1:], white[:, 0]
        filled += 2
        if filled == _ROWS_AT_ONCE:
            J, h, power, rows = J + X.T @ X, h + X.T @ y, power + float(y @ y), rows + filled
            filled = 0
    X, y = X[:filled], y[:filled]
    J, h, power, rows = J + X.T @ X, h + X.T @ y, power + float(y @ y), rows + filled
    if fixes < 5:
        raise CalibrationRefusedError(
            f"{log.name} has {fixes} fixes within its packets; a flight needs at least five"
        )
    a, b = slice(0, NUISANCES), slice(NUISANCES, size)
    factor = cho_factor(J[a, a] + np.diag(1.0 / priors.variances()))
    own = cho_solve(factor, h[a])
    response = cho_solve(factor, J[a, b])
    inside = (log.end_s >= log.fix_s[0]) & (log.end_s <= log.fix_s[-1])
    heading = log.heading_rad[inside]
    return FlightEquations(
        log.name, J[b, b] - J[b, a] @ response, h[b] - J[b, a] @ own, power - float(h[a] @ own), rows,
        own, response, cho_solve(factor, np.eye(NUISANCES)),
        float(np.ptp(heading)) if len(heading) else 0.0, float(np.ptp(log.end_s)),
        log.position_table_m.mean(axis=0),
    )  # fmt: skip
