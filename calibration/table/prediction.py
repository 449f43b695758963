"""How much a map improves a prediction on a flight it was not learned from: fixes taken away for a while."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError
from calibration.table.chain import NUISANCES, innovations
from calibration.table.equations import FlightPriors
from calibration.table.flight_log import FlightLog

Array = NDArray[np.float64]
Pull = Callable[[Array], Array]
"""Acceleration (n, 2) in m/s^2 at positions (n, 2), table frame."""


@dataclass(frozen=True, slots=True)
class OutageCheck:
    """Position error at the end of star outages, RMS over all of them (2-D)."""

    without_m: float
    """With no slope at all."""
    mean_only_m: float
    """With the mean slope."""
    with_map_m: float
    outages: int
    length_s: float


@dataclass(frozen=True, slots=True, eq=False)
class _Known:
    """A field of one column that is a known pull."""

    pull: Pull
    size: int = 1

    def columns(self, position_m: Array) -> Array:
        return self.pull(position_m)[:, :, None]


def check_outages(
    log: FlightLog,
    pull: Pull,
    mean_m_s2: tuple[float, float],
    priors: FlightPriors,
    length_s: float = 10.0,
    seen_s: float = 10.0,
) -> OutageCheck:
    """Predict through made-up outages of a fresh flight, with the map, with the mean slope, and without.

    The flight's own unknowns (bias, scale, lever arm) are estimated from all fixes for each of the three.

    Raises:
        CalibrationRefusedError: the flight is too short for an outage.
    """
    phase = np.mod(log.fix_s - log.fix_s[0], length_s + seen_s)
    used = (phase < seen_s) | log.is_resting(log.fix_s)
    errors = []
    for field in (
        _Known(lambda p: np.zeros((len(p), 2))),
        _Known(lambda p: np.broadcast_to(np.asarray(mean_m_s2), (len(p), 2)).copy()),
        _Known(pull),
    ):
        own = _own_unknowns(log, field, priors)
        unknowns = np.concatenate([own, [0.0, 0.0, 1.0]])
        ends = [
            i.value - i.columns @ unknowns
            for i in innovations(log, field, priors.bias_walk_m_s2_rts, used)
            if i.is_fix and 0.8 * length_s < i.since_fix_s < 1.5 * length_s
        ]
        errors.append(np.array(ends).reshape(-1, 2))
    if not len(errors[0]):
        raise CalibrationRefusedError(f"{log.name} is too short for an outage of {length_s:g} s")
    rms = [float(np.sqrt((e**2).sum(axis=1).mean())) for e in errors]
    return OutageCheck(rms[0], rms[1], rms[2], len(errors[0]), length_s)


def _own_unknowns(log: FlightLog, field: _Known, priors: FlightPriors) -> Array:
    J, h = np.diag(1.0 / priors.variances()), np.zeros(NUISANCES)
    for innovation in innovations(log, field, priors.bias_walk_m_s2_rts):
        if innovation.covariance.trace() > 1.0:
            continue
        A = innovation.columns[:, :NUISANCES]
        weight = np.linalg.inv(innovation.covariance)
        J += A.T @ weight @ A
        h += A.T @ weight @ (innovation.value - innovation.columns[:, -1])
    return np.asarray(np.linalg.solve(J, h))
