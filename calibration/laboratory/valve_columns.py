"""What commanded pulses should have done to accelerometers and gyro, and how that depends on what.

A mock-up that glides feels no slope: its accelerometers read thrust over mass, and the gyro the integral of
torque over inertia,

    f = sum p_v share_v d_v + alpha x r - rate^2 r - drag v + bias        alpha = sum a_v share_v
    rate = sum a_v integral(share_v) - drag heading + bias

with p_v, a_v linear and delays, rise and sag not. Biases are straight between knots. How much later than
usual a valve opened is one unknown per opening.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array, vstack

from calibration.laboratory.recorded_flight import RecordedFlight
from calibration.laboratory.thrust_course import (
    POLL_S,
    Openings,
    Timing,
    course,
    kept_of,
    lagged,
    openings,
)

Array = NDArray[np.float64]

FORCE, TURN = slice(0, 8), slice(8, 16)
CROSS_XY, CROSS_YX, LEVER_X, LEVER_Y, DRAG, TURN_DRAG = range(16, 22)
OPEN, CLOSE, RISE, SAG = range(22, 26)
CORE = 26
"""Unknowns that are not of one moment: forces, turns, nuisances, timing."""
TIMING_NAMES = ("open_s", "close_s", "rise_s", "sag")
TIMING_STEPS = (5e-5, 5e-5, 5e-5, 5e-3)
"""For differences."""
KNOT_S = 20.0
"""Between knots of the biases, which follow the temperature of the sensors."""
DOUBT_S = 2e-3
"""A pulse as long as the delay of opening, give or take this, may not have opened its valve."""
SETTLE_S = 0.06
"""After such a pulse the sensors are not looked at for so long."""
START_S = 0.5
"""By which the zero of the rate is taken where only its course is looked at."""
REACH = 8.0
"""Time constants after which a step is over."""


@dataclass(frozen=True, slots=True, eq=False)
class ValveModel:
    """What the rig states, and how far off it may be (one sigma).

    Attributes:
        direction: (8, 2) of each force, body axes.
        force_m_s2, turn_rad_s2: (8,) of each valve at full thrust, over mass and inertia.
        lever_m: Accelerometers from the centre of mass.
        lever_sigma_m: Of each component.
        timing: Where the search begins.
        acc_lag_s, gyro_lag_s: Of the sensors' low-pass.
    """

    direction: Array
    force_m_s2: Array
    turn_rad_s2: Array
    lever_m: tuple[float, float]
    lever_sigma_m: float
    timing: Timing
    acc_lag_s: float
    gyro_lag_s: float


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Of the centre of mass in the middle of each packet, smoothed.

    Attributes:
        heading_rad: (n,) unwrapped.
        velocity_body_m_s: (n, 2).
        rate_rad_s: (n,) without the gyro's bias.
    """

    heading_rad: Array
    velocity_body_m_s: Array
    rate_rad_s: Array


class ValveEquations:
    """The flight's data, and the columns of the linearised model."""

    def __init__(self, flight: RecordedFlight, model: ValveModel, motion: Motion) -> None:
        self.flight, self.model, self.motion = flight, model, motion
        n, polls = len(flight.rate_rad_s), flight.windows.polls
        self.n = n
        seconds = (flight.windows.last - flight.windows.last[0]) * POLL_S
        self.hats = _hats(seconds, KNOT_S)
        self._row_of_poll = np.full(flight.polls + 1, -1, dtype=np.intp)
        for back in range(polls):
            self._row_of_poll[flight.windows.last - back] = np.arange(n)
        self.clean = np.ones((3, n), dtype=np.bool_)

    def open(self, timing: Timing) -> Openings:
        flight = self.flight
        return openings(flight.coils, flight.coil_start, flight.coil_stop, timing, DOUBT_S)

    def shares(self, timing: Timing, jitter_s: float, opened: Openings | None = None) -> tuple[Array, Array]:
        """(n, 8) thrust over full thrust as accelerometers, and its integral as the gyro feel it."""
        found = course(opened or self.open(timing), timing, self.flight.polls, jitter_s)
        felt = lagged(found.share, self.model.acc_lag_s)
        turned = lagged(found.turned_s, self.model.gyro_lag_s)
        return self.flight.windows.mean(felt), self.flight.windows.mean(turned)

    def predicted(self, value: Array, shares: tuple[Array, Array]) -> tuple[Array, Array]:
        """Force (n, 2) and rate (n,) without biases."""
        share, turned = shares
        turn = share @ value[TURN]
        push = share @ (value[FORCE, None] * self.model.direction)
        lever_x, lever_y = value[LEVER_X], value[LEVER_Y]
        square = self.motion.rate_rad_s**2
        force = push - value[DRAG] * self.motion.velocity_body_m_s
        force = force + np.column_stack(
            [-turn * lever_y - square * lever_x, turn * lever_x - square * lever_y]
        )
        crossed = force[:, ::-1] * value[[CROSS_XY, CROSS_YX]]
        return force + crossed, turned @ value[TURN] - value[TURN_DRAG] * self.motion.heading_rad

    def left(self, value: Array, jitter_s: float) -> tuple[Array, Array]:
        """Forces (n, 2) and rate (n,) less what is predicted, biases taken out; the rate begins at zero."""
        force, rate = self.predicted(value, self.shares(Timing(*value[OPEN:CORE].tolist()), jitter_s))
        rest = self.flight.force_m_s2 - force
        rest -= self.hats @ np.linalg.lstsq(self.hats, rest, rcond=None)[0]
        turned = self.flight.rate_rad_s - rate
        return rest, turned - turned[: max(1, round(START_S / POLL_S / self.flight.windows.polls))].mean()

    def columns(
        self,
        value: Array,
        jitter_s: float,
        opened: Openings,
        shares: tuple[Array, Array],
        plain: tuple[Array, Array],
    ) -> tuple[Array, ...]:
        """Derivatives (n, 26) of force x, force y and rate by the core."""
        share, turned = shares
        timing = Timing(*value[OPEN:CORE].tolist())
        x, y, rate = (np.zeros((self.n, CORE)) for _ in range(3))
        x[:, FORCE], y[:, FORCE] = share * self.model.direction[:, 0], share * self.model.direction[:, 1]
        x[:, TURN], y[:, TURN], rate[:, TURN] = -share * value[LEVER_Y], share * value[LEVER_X], turned
        turn, square = share @ value[TURN], self.motion.rate_rad_s**2
        x[:, CROSS_XY], y[:, CROSS_YX] = plain[0][:, 1], plain[0][:, 0]
        x[:, LEVER_X], x[:, LEVER_Y] = -square, -turn
        y[:, LEVER_X], y[:, LEVER_Y] = turn, -square
        x[:, DRAG], y[:, DRAG] = -self.motion.velocity_body_m_s.T
        rate[:, TURN_DRAG] = -self.motion.heading_rad
        names = ("open_s", "close_s", "rise_s", "sag")
        for place, (name, step) in enumerate(zip(names, TIMING_STEPS, strict=True), OPEN):
            # which valve opened is taken as it is: only its edges move
            edges = replace(
                opened,
                begin=opened.begin + (step / POLL_S if place == OPEN else 0.0),
                end=opened.end + (step / POLL_S if place == CLOSE else 0.0),
            )
            other = replace(timing, **{name: value[place] + step})
            moved = self.predicted(value, self.shares(other, jitter_s, edges))
            x[:, place], y[:, place] = ((moved[0] - plain[0]) / step).T
            rate[:, place] = (moved[1] - plain[1]) / step
        return x, y, rate

    def jitter_columns(self, value: Array, opened: Openings) -> csr_array:
        """(2 n, p) derivatives of the forces by how much later each opening was, s."""
        rise_s = float(value[RISE])
        reach = math.ceil(8.0 * max(rise_s, self.model.acc_lag_s) / POLL_S) + 2
        left = kept_of(rise_s)
        kernel = -(left ** np.arange(reach)) / rise_s
        if self.model.acc_lag_s > 0.0:
            kernel = lagged(np.concatenate([[0.0], kernel]), self.model.acc_lag_s)[1:]
        first = np.ceil(opened.begin).astype(np.intp)
        began = left ** (first - opened.begin)
        polls = np.clip(np.add.outer(first, np.arange(reach)), 0, self.flight.polls)
        rows = self._row_of_poll[polls]
        signature = value[FORCE, None] * self.model.direction
        turn = value[TURN]
        signature = signature + np.column_stack([-turn * value[LEVER_Y], turn * value[LEVER_X]])
        parts = []
        for axis in range(2):
            size = np.outer(signature[opened.valve, axis] * began, kernel) / self.flight.windows.polls
            seen = (rows >= 0) & (~opened.is_doubtful)[:, None]
            which = np.broadcast_to(np.arange(len(first))[:, None], rows.shape)
            parts.append(coo_array((size[seen], (rows[seen], which[seen])), shape=(self.n, len(first))))
        return vstack(parts, format="csr")

    def walk_weights(self, value: Array, opened: Openings, polls: int) -> Array:
        """(n,) sum of squared turns of the valves that open within each packet."""
        rows = self._row_of_poll[np.clip(np.ceil(opened.begin).astype(np.intp), 0, polls)]
        seen = (rows >= 0) & ~opened.is_doubtful
        weights = value[TURN][opened.valve[seen]] ** 2
        return np.asarray(np.bincount(rows[seen], weights, minlength=self.n), dtype=np.float64)

    def hidden_by(self, opened: Openings) -> NDArray[np.bool_]:
        """(n,) what doubtful openings may have pushed."""
        hidden = np.zeros(self.n, dtype=np.bool_)
        for start, stop in opened.doubtful_spans:
            last = min(self.flight.polls, int(stop + SETTLE_S / POLL_S))
            rows = self._row_of_poll[max(0, int(start)) : max(0, last)]
            hidden[rows[rows >= 0]] = True
        return hidden


def _hats(seconds: Array, knot_s: float) -> Array:
    """(n, knots) of values that are straight between knots."""
    knots = max(1, round(float(seconds[-1]) / knot_s)) + 1
    place = seconds / float(seconds[-1]) * (knots - 1)
    return np.maximum(0.0, 1.0 - np.abs(place[:, None] - np.arange(knots)))
