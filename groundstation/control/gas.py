"""From the pressure of the tank to how long it lasts: floating only, and under control as of late.

A tank that keeps its temperature loses pressure in proportion to the gas that left it,

    pressure = pressure at first - float x time afloat - valve x time of open valves,

with both rates found by least squares over the history. Whoever floats and steers evenly all the time shows
only the sum of both: then how long it would float without steering is not known, and not said. A tank that
cools while it is emptied fast shows less than it holds.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_PIECES = 12
_FILLED_SIGMAS = 8.0
_SURE = 3.0
"""A consumption below so many sigmas has not been seen."""
_LEAST_SAMPLES = 10
_ONE = 1e-6
"""Columns that differ by less are one; smaller, and variances that cancel would leave only rounding."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GasConfig:
    """What is known of the tank.

    Attributes:
        reserve_pa: The tank counts as empty there.
        pressure_sigma_pa: Of a reading, at least.
        steering_s: So long back consumption counts as that of the future.
    """

    reserve_pa: float = 30e5
    pressure_sigma_pa: float = 0.2e5
    steering_s: float = 60.0


@dataclass(frozen=True, slots=True, eq=False)
class GasHistory:
    """Readings of one tank, in order; each of shape (n,).

    Attributes:
        t_s: When.
        pressure_pa: Of the tank; not a number where none was read.
        afloat_s: How long the float air had been on by then.
        valves_s: How long valves had been open by then, summed over valves.

    Raises:
        ValueError: The lengths differ, or time or one of the sums goes back.
    """

    t_s: Floats
    pressure_pa: Floats
    afloat_s: Floats
    valves_s: Floats

    def __post_init__(self) -> None:
        columns = (self.t_s, self.pressure_pa, self.afloat_s, self.valves_s)
        if len({column.shape for column in columns}) != 1 or self.t_s.ndim != 1:
            raise ValueError(f"a history has as many of each, found {[column.shape for column in columns]}")
        for name, column in (("time", self.t_s), ("float", self.afloat_s), ("valves", self.valves_s)):
            if not (np.diff(column) >= 0.0).all():
                raise ValueError(f"a history must not go back, its {name} does")


@dataclass(frozen=True, slots=True)
class Lasts:
    """A span and its sigma."""

    span_s: float
    sigma_s: float


@dataclass(frozen=True, slots=True)
class GasLeft:
    """What is in the tank.

    Attributes:
        pressure_pa: Freed of noise; not a number without readings.
        afloat: How long it floats without steering; None if that cannot be known yet.
        steering: How long it floats and steers as it did of late; None likewise.
        reason: Why one of them is None, in words; empty otherwise.
    """

    pressure_pa: float
    afloat: Lasts | None
    steering: Lasts | None
    reason: str


def gas_left(history: GasHistory, config: GasConfig) -> GasLeft:
    """How long the gas lasts. A tank that was filled begins a new history.

    Args:
        history: All readings that are kept; one a second is enough.
        config: What is known of the tank.
    """
    t_s, pressure_pa, afloat_s, valves_s = _since_filled(history, config.pressure_sigma_pa)
    if len(t_s) < _LEAST_SAMPLES:
        newest = float(pressure_pa[-1]) if len(t_s) else math.nan
        return GasLeft(newest, None, None, f"only {len(t_s)} readings of the tank since it was filled")
    columns = np.column_stack([np.ones(len(t_s)), afloat_s[-1] - afloat_s, valves_s[-1] - valves_s])
    value, covariance = _fit(columns, pressure_pa, config.pressure_sigma_pa)
    room_pa = value[0] - config.reserve_pa
    afloat = _lasts(float(room_pa), value, covariance, _Steering(0.0, 0.0, 1.0))
    use = _steering(t_s, valves_s, config.steering_s)
    steering = _lasts(float(room_pa), value, covariance, use)
    reason = ""
    if steering is None:
        reason = "no consumption is seen yet"
    elif afloat is None:
        reason = "what the float air takes cannot be told from what the valves take, or is nothing"
    return GasLeft(float(value[0]), afloat, steering, reason)


def _since_filled(history: GasHistory, sigma_pa: float) -> tuple[Floats, Floats, Floats, Floats]:
    read = np.isfinite(history.pressure_pa)
    columns = [
        column[read] for column in (history.t_s, history.pressure_pa, history.afloat_s, history.valves_s)
    ]
    filled = np.flatnonzero(np.diff(columns[1]) > _FILLED_SIGMAS * sigma_pa)
    begin = int(filled[-1]) + 1 if len(filled) else 0
    t_s, pressure_pa, afloat_s, valves_s = (column[begin:] for column in columns)
    return t_s, pressure_pa, afloat_s, valves_s


def _fit(columns: Floats, pressure_pa: Floats, sigma_pa: float) -> tuple[Floats, Floats]:
    """Pressure now, and what a second of float and of an open valve takes; their covariance.

    A column that does not differ from others leaves large variances, not an error.
    """
    size = np.maximum(np.abs(columns).max(axis=0), 1e-9)
    scaled = columns / size
    u, lengths, axes = np.linalg.svd(scaled, full_matrices=False)
    seen = np.maximum(lengths, _ONE * lengths[0])
    value = axes.T @ ((u.T @ pressure_pa) * (lengths > _ONE * lengths[0]) / seen)
    left = pressure_pa - scaled @ value
    variance = max(sigma_pa**2, float(left @ left) / max(1, len(left) - 3))
    covariance = (axes.T / seen**2) @ axes * variance
    return value / size, covariance / np.outer(size, size)


class _Steering(NamedTuple):
    """Open valves of late: mean, density of their scatter (valve^2 s), and how long they were watched."""

    valves: float
    density: float
    while_s: float


def _steering(t_s: Floats, valves_s: Floats, back_s: float) -> _Steering:
    span_s = min(back_s, float(t_s[-1] - t_s[0]))
    if span_s <= 0.0:
        return _Steering(0.0, 0.0, 1.0)
    marks = np.linspace(t_s[-1] - span_s, t_s[-1], _PIECES + 1)
    rates = np.diff(np.interp(marks, t_s, valves_s)) * _PIECES / span_s
    return _Steering(float(rates.mean()), float(rates.var(ddof=1)) * span_s / _PIECES, span_s)


def _lasts(room_pa: float, value: Floats, covariance: Floats, use: _Steering) -> Lasts | None:
    """How long the room lasts at a use of valves, if so much consumption is seen.

    The scatter of the use counts twice: its mean is known from a while only, and what will come scatters.
    """
    weights = np.array([0.0, 1.0, use.valves])
    rate_pa_s = float(weights @ value)
    rate_sigma = math.sqrt(max(0.0, float(weights @ covariance @ weights)))
    if rate_pa_s <= _SURE * rate_sigma:
        return None
    span_s = max(0.0, room_pa / rate_pa_s)
    slope = (np.array([1.0, 0.0, 0.0]) - span_s * weights) / rate_pa_s
    per_valve = span_s * float(value[2]) / rate_pa_s
    scatter = use.density * (1.0 / use.while_s + 1.0 / max(span_s, 1.0))
    # where float and valves were one, variances are huge and cancel but for rounding
    by_fit = max(0.0, float(slope @ covariance @ slope))
    return Lasts(span_s, math.sqrt(by_fit + per_valve**2 * scatter))
