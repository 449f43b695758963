"""Flights of the study estimated again, by the published methods and by ours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.estimator import EstimatorFactory
from groundstation.fusion.estimators import ESTIMATORS
from groundstation.fusion.flight_data import estimate
from groundstation.studies.flown import Flown

Array = NDArray[np.float64]
X, Y, HEADING, VX, VY, RATE = range(1, 7)
"""Columns of an estimate, behind the moment."""


def estimated(flown: Flown, method: str) -> Array:
    """Return rows of s from t = 0, x, y, heading, velocity x, y, rate; shape (n, 7), NaN where there is none.

    Args:
        flown: The flight.
        method: Row of the table of estimators.
    """
    factory: EstimatorFactory = ESTIMATORS[method]
    states, _ = estimate(flown.data, factory(flown.data.noise))
    rows = np.full((len(states), 7), np.nan)
    rows[:, 0] = flown.data.imu[:, 0] - flown.zero_s
    for number, state in enumerate(states):
        if state is not None:
            rows[number, 1:] = (*state[1:4], *state[4:7])
    return rows


def as_flown(flown: Flown) -> Array:
    """Return the states that the flight itself went by, in the same columns."""
    rows = flown.states.copy()
    rows[:, 0] -= flown.zero_s
    return rows


def off_truth(flown: Flown, rows: Array) -> Array:
    """Return an estimate minus the truth: x, y, heading, velocity x, y, rate; shape (6, n)."""
    off = rows[:, 1:].T - flown.truth(rows[:, 0] + flown.zero_s)
    off[2] = np.angle(np.exp(1j * off[2]))
    return np.asarray(off)


def at(rows: Array, t_s: Array) -> Array:
    """Return an estimate at moments, shape (6, n)."""
    return np.array([np.interp(t_s, rows[:, 0], row) for row in rows[:, 1:].T])


def rms(values: Array) -> float:
    """Root of the mean square of those that are numbers."""
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")


def star_curve(flown: Flown) -> Array:
    """Return what stars alone give, a row at each arrival: s from t = 0, x, y, heading, velocity x, y, rate.

    Velocities are differences of two fixes; as shown live, each is late by what the star tracker takes.
    """
    stars = flown.data.stars
    heading = np.unwrap(stars[:, 4])
    span_s = np.diff(stars[:, 0])
    rates = [np.diff(row, prepend=row[:1]) for row in (stars[:, 2], stars[:, 3], heading)]
    for rate in rates:
        rate[1:] /= span_s
    return np.column_stack([stars[:, 1] - flown.zero_s, stars[:, 2], stars[:, 3], heading, *rates])
