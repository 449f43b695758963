"""Thrust over mass and torque over inertia of every valve, and the timing that they share, from one flight.

Gauss and Newton's steps over `valve_columns`. What openings differ from each other by is a variance that is
estimated with those of the sensors (Foerstner's variance components), and scores are summed over stretches of
flight, so that the sigmas are those of the flight as it was.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.laboratory.normal_equations import solved, surer, widened
from calibration.laboratory.rate_reading import RateReading, read_rates
from calibration.laboratory.recorded_flight import RecordedFlight
from calibration.laboratory.scatter import PulseScatter, RateWhitener
from calibration.laboratory.thrust_course import POLL_S, Openings, Timing
from calibration.laboratory.valve_columns import (
    CLOSE,
    CORE,
    CROSS_XY,
    CROSS_YX,
    DRAG,
    FORCE,
    LEVER_X,
    LEVER_Y,
    OPEN,
    RISE,
    SAG,
    TURN,
    TURN_DRAG,
    Motion,
    ValveEquations,
    ValveModel,
)
from calibration.outcome import CalibrationRefusedError
from drivers.valve_bus.messages import VALVES
from groundstation.cli.progress import Progress

Array = NDArray[np.float64]

MOST_STEPS, SETTLED_STEPS = 40, 3
LARGEST_STEP_S, SETTLED_S, SETTLED_SIGMAS = 4e-3, 1e-6, 0.05
DAMPED_AFTER = 15
"""Steps that have not settled by then go to and fro: each side leaves out other packets at pulses' edges."""
TO_AND_FRO_SIGMAS = 1.0
"""The middle of two such sides is taken where they are no farther apart; half of that adds to the sigmas."""
OUTLIER_SIGMAS = 6.0
TIMINGS = np.arange(OPEN, SAG)
LEAST_RISE_S = 2e-4
EARLIEST_S = -0.02
"""A delay below zero states that the stamps are off; it is searched for, and not believed."""
LEAST_SAG, MOST_SAG = 0.5, 1.1
FIRST_JITTER_S, LEAST_JITTER_S = 5e-4, 1e-5
FIRST_FORCE_M_S2, FIRST_RATE_RAD_S = 1e-3, 1e-3
FIRST_WALK_RAD_S = 1e-6
"""Scatter of a packet from which the search begins."""
CROSS_SIGMA = 1e-2
DRAG_SIGMA_PER_S = 0.1
DELAY_SIGMA_S, RISE_SIGMA_S = 0.05, 0.01
STRETCH_S = 1.0
"""Errors further apart are taken for independent."""
SAG_SIGMA = 0.03
"""What is taken for possible before the flight."""


@dataclass(frozen=True, slots=True)
class Spreads:
    """Scatter of a packet's force and rate and of the moments of opening; what the rate walks by packets."""

    force_m_s2: float = FIRST_FORCE_M_S2
    rate_rad_s: float = FIRST_RATE_RAD_S
    jitter_s: float = FIRST_JITTER_S
    walk_rad_s: float = FIRST_WALK_RAD_S


@dataclass(frozen=True, slots=True, eq=False)
class ValveFit:
    """What was found.

    Attributes:
        value: (26,) unknowns of `valve_columns`.
        covariance: (26, 26).
        spreads: Of packets and openings.
        jitter_seen: Effective number of openings that told their scatter.
        packets: How many were used.
        on_s: (8,) how long each valve was open.
        openings: (8,) how often.
        force_before_m_s2, force_after_m_s2: (n, 2) residuals with the rig's values, and with those found.
        rate_before_rad_s, rate_after_rad_s: (n,) likewise.
        outliers: Packets that were left out.
        opened: When which valve was open.
        reading: Of the gyro.
    """

    value: Array
    covariance: Array
    spreads: Spreads
    jitter_seen: float
    packets: int
    on_s: Array
    openings: NDArray[np.intp]
    force_before_m_s2: Array
    force_after_m_s2: Array
    rate_before_rad_s: Array
    rate_after_rad_s: Array
    outliers: int
    opened: Openings
    reading: RateReading

    @property
    def sigma(self) -> Array:
        """(26,) of each value."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


@dataclass(frozen=True, slots=True, eq=False)
class _Step:
    """What is to be added to the values, what it says of the spreads, and what is left."""

    change: Array
    covariance: Array
    spreads: Spreads
    jitter_seen: float
    packets: int
    force_left: Array
    rate_left: Array
    rate_fitted: Array
    outliers: NDArray[np.bool_]
    opened: Openings


def fit_valves(flight: RecordedFlight, model: ValveModel, motion: Motion, progress: Progress) -> ValveFit:
    """Fit all valves of a flight.

    Raises:
        CalibrationRefusedError: No valve was open while the vehicle floated, or the search does not settle.
    """
    equations = ValveEquations(flight, model, motion)
    timing = model.timing
    start = np.zeros(CORE)
    start[FORCE], start[TURN] = model.force_m_s2, model.turn_rad_s2
    start[LEVER_X], start[LEVER_Y] = model.lever_m
    start[OPEN:CORE] = timing.open_s, timing.close_s, timing.rise_s, timing.sag
    if not len(equations.open(timing).valve):
        raise CalibrationRefusedError(f"no valve of {flight.vehicle} was open while it floated")
    polls = flight.windows.polls
    reading = RateReading(flight.rate_rad_s, math.nan, math.nan)
    value, prior = start, _prior(model)
    before = equations.left(start, FIRST_JITTER_S)
    found = _step(equations, value, start, prior, Spreads(), reading)
    settled, is_cleaned = 0, False
    for number in range(MOST_STEPS):
        progress("fitting the valves", number / MOST_STEPS)
        moved = np.abs(found.change[OPEN:SAG])
        excess = max(1.0, float(moved.max()) / LARGEST_STEP_S, 2.0 * (number > DAMPED_AFTER))
        value = _bounded(value + found.change / excess)
        sigmas = TO_AND_FRO_SIGMAS if number > DAMPED_AFTER else SETTLED_SIGMAS
        near = np.maximum(SETTLED_S, sigmas * np.sqrt(found.covariance.diagonal()[OPEN:SAG]))
        settled = settled + 1 if (moved < near).all() else 0
        if settled >= SETTLED_STEPS:
            if is_cleaned:
                found.covariance[TIMINGS, TIMINGS] += (0.5 * moved) ** 2
                break
            equations.clean &= ~found.outliers
            settled, is_cleaned = 0, True
        reading = read_rates(flight.rate_rad_s, found.rate_fitted, found.spreads.rate_rad_s, polls)
        found = _step(equations, value, start, prior, found.spreads, reading)
    else:
        raise CalibrationRefusedError(
            f"the timing of the valves of {flight.vehicle} does not settle: what was commanded is not what "
            "pushed it"
        )
    opened = found.opened
    on_polls = np.bincount(opened.valve, opened.end - opened.begin, minlength=VALVES)
    return ValveFit(
        value,
        found.covariance,
        found.spreads,
        found.jitter_seen,
        found.packets,
        np.asarray(on_polls * POLL_S, dtype=np.float64),
        np.bincount(opened.valve, minlength=VALVES),
        before[0],
        found.force_left,
        before[1],
        found.rate_left,
        int((~equations.clean).any(axis=0).sum()),
        opened,
        reading,
    )


def _prior(model: ValveModel) -> Array:
    """Information (26,) about the start: valves are not believed at all, the rest hardly."""
    sigma = np.empty(CORE)
    sigma[FORCE], sigma[TURN] = 10.0 * model.force_m_s2, 10.0 * np.abs(model.turn_rad_s2)
    sigma[[CROSS_XY, CROSS_YX]], sigma[[LEVER_X, LEVER_Y]] = CROSS_SIGMA, model.lever_sigma_m
    sigma[[DRAG, TURN_DRAG]] = DRAG_SIGMA_PER_S
    sigma[[OPEN, CLOSE]], sigma[RISE], sigma[SAG] = DELAY_SIGMA_S, RISE_SIGMA_S, SAG_SIGMA
    return np.asarray(1.0 / np.maximum(sigma, 1e-9) ** 2)


def _bounded(value: Array) -> Array:
    value = value.copy()
    value[[OPEN, CLOSE]] = np.maximum(EARLIEST_S, value[[OPEN, CLOSE]])
    value[RISE] = max(LEAST_RISE_S, value[RISE])
    value[SAG] = min(MOST_SAG, max(LEAST_SAG, value[SAG]))
    return value


def _step(
    equations: ValveEquations, value: Array, start: Array, core: Array, spreads: Spreads, reading: RateReading
) -> _Step:
    """One step of Gauss and Newton, and of the variance components."""
    flight, n = equations.flight, equations.n
    timing = Timing(*value[OPEN:CORE].tolist())
    opened = equations.open(timing)
    used = equations.clean & ~equations.hidden_by(opened)
    shares = equations.shares(timing, spreads.jitter_s, opened)
    force, rate = equations.predicted(value, shares)
    x, y, turn = equations.columns(value, spreads.jitter_s, opened, shares, (force, rate))
    hats, knots = equations.hats, equations.hats.shape[1]
    force_left = flight.force_m_s2 - force
    rate_left = reading.rate_rad_s - rate
    # forces: what is not of one moment, biases, and the moments of opening, which are eliminated
    zeros = np.zeros_like(hats)
    columns = np.vstack([np.hstack([x, hats, zeros]), np.hstack([y, zeros, hats])])
    weight = used[:2].ravel() / spreads.force_m_s2
    pulses = PulseScatter(equations.jitter_columns(value, opened), weight, spreads.jitter_s)
    normal, right = pulses.reduced(columns, force_left.T.ravel())
    stretches = (flight.windows.last * POLL_S / STRETCH_S).astype(np.intp)
    # rate: its differences
    whitener = RateWhitener(
        n, spreads.rate_rad_s, spreads.walk_rad_s, equations.walk_weights(value, opened, flight.polls),
        spreads.jitter_s, ~used[2],
    )  # fmt: skip
    turns = np.hstack([turn, hats[:, 1:]])  # a constant has no differences
    white = whitener(np.column_stack([turns, rate_left]))
    here = np.r_[0:CORE, CORE + 2 * knots : CORE + 3 * knots - 1]
    normal, right = widened(normal, right, knots - 1)
    normal[np.ix_(here, here)] += white[:, :-1].T @ white[:, :-1]
    right[here] += white[:, :-1].T @ white[:, -1]
    normal[:CORE, :CORE] += np.diag(core)
    right[:CORE] += core * (start - value)
    solution, covariance = solved(normal, right)
    force_rest = (force_left.T.ravel() - columns @ solution[: columns.shape[1]]).reshape(2, n)
    rate_rest = rate_left - turns @ solution[here]
    moments = pulses.moments(force_rest.ravel())
    force_rest -= moments.moved.reshape(2, n)
    deviation = force_rest / spreads.force_m_s2
    covariance = surer(
        covariance,
        [
            (columns * weight[:, None], force_rest.ravel() * weight, np.tile(stretches, 2)),
            (_at(white[:, :-1], here, len(right)), whitener(rate_rest[:, None])[:, 0], stretches[1:]),
        ],
    )
    free = used[:2].sum() - moments.seen - 2 * knots
    force_sigma = math.sqrt(float((force_rest[used[:2]] ** 2).sum()) / free)
    rate_sigma, walk = whitener.likeliest(rate_rest)
    wild = np.abs(np.diff(rate_rest, append=rate_rest[-1:])) > OUTLIER_SIGMAS * math.sqrt(2.0) * rate_sigma
    return _Step(
        solution[:CORE],
        covariance[:CORE, :CORE],
        Spreads(force_sigma, rate_sigma, max(LEAST_JITTER_S, moments.jitter_s), walk),
        moments.seen,
        int(used[2].sum()),
        force_rest.T,
        rate_rest,
        rate + turns @ solution[here] + whitener.slow(rate_rest),
        np.vstack([np.abs(deviation) > OUTLIER_SIGMAS, wild]),
        opened,
    )


def _at(columns: Array, places: NDArray[np.intp], size: int) -> Array:
    """Return columns at their places among all unknowns."""
    wide = np.zeros((len(columns), size))
    wide[:, places] = columns
    return wide
