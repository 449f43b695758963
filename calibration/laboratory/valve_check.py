"""What was learned of valves tried on a flight that had no part in it: do the pulses move the vehicle so?

Windows of half a second: what the accelerometers add up to and how the rate changes, beside what the pulses
of that window should have given. A mock-up that glides feels no slope; the accelerometers' zero is taken from
the blocks of the same flight in which no valve was open.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from calibration.outcome import CalibrationRefusedError
from groundstation.control.vehicle import VehicleModel
from groundstation.declarations.message import Message
from groundstation.parts.fusion.messages import FusionStatus
from groundstation.parts.imu.messages import Imu
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveCommand
from groundstation.supervision.thrust_blocks import Block, ThrustBlocks
from groundstation.supervision.valve_estimate import IdentificationConfig

Array = NDArray[np.float64]

WINDOW_S = 0.5
LEAST_WINDOWS, LEAST_COASTING = 10, 25
SHUT = 1e-3
"""Shares of thrust below this are none."""


@dataclass(frozen=True, slots=True, eq=False)
class Valves:
    """What each valve gives, over the rig's.

    Attributes:
        thrust: (n,) thrust over mass.
        torque: (n,) torque over inertia.
        dead_s: (n,) opening less closing delay.
    """

    thrust: Array
    torque: Array
    dead_s: Array


@dataclass(frozen=True, slots=True, eq=False)
class Misses:
    """What the windows show.

    Attributes:
        t_s: (k,) end of each window, host time.
        missed: (k, 3) measured less predicted: m/s, m/s, rad/s.
        moved: (k, 3) measured.
    """

    t_s: Array
    missed: Array
    moved: Array

    @property
    def rms(self) -> Array:
        """(3,) of what was missed."""
        return np.asarray(np.sqrt((self.missed**2).mean(axis=0)))


class ValveCheck:
    """Collects a flight that is set aside.

    Args:
        model: Of the rig.
        config: What the rig states of valves and IMU.
    """

    def __init__(self, model: VehicleModel, config: IdentificationConfig) -> None:
        self._model, self._config = model, config
        delays_s = (config.open_delay_s, config.close_delay_s)
        lags_s = (config.acc_lag_s, config.gyro_lag_s)
        self._cut = ThrustBlocks(
            model, delays_s, config.rise_s, lags_s, config.block_s, config.sag, config.step_s
        )
        self._blocks: list[tuple[float, Block]] = []
        self._zero_rad_s = 0.0
        self._is_afloat = False

    @property
    def length_s(self) -> float:
        """Of what was collected."""
        return sum(block.span_s for _, block in self._blocks)

    def take(self, message: Message) -> None:
        """Take a message of the vehicle."""
        match message:
            case Imu() if message.valid and self._is_afloat:
                block = self._cut.sample(
                    message.stamp_ns,
                    message.window_s,
                    message.rate_body_rad_s - self._zero_rad_s,
                    message.force_body_m_s2,
                )
                if block is not None:
                    self._blocks.append((message.stamp_ns * 1e-9, block))
            case ValveCommand():
                self._cut.command(message.stamp_ns, message.pulse_id, message.on_time_ms)
            case FusionStatus():
                self._zero_rad_s = message.bias_rate_rad_s
            case Supervision():
                self._is_afloat = message.is_in_flight

    def misses(self, valves: Valves) -> Misses:
        """How far a prediction by these valves misses what was measured.

        Raises:
            CalibrationRefusedError: It flew too short, or never without a push.
        """
        zero = self._zero()
        rows = [(t_s, *self._miss(window, valves, zero)) for t_s, window in self._windows()]
        if len(rows) < LEAST_WINDOWS:
            raise CalibrationRefusedError(
                f"{len(rows)} windows of {WINDOW_S:g} s with a push were flown, {LEAST_WINDOWS} are needed"
            )
        return Misses(
            np.array([t_s for t_s, _, _ in rows]),
            np.array([missed for _, missed, _ in rows]),
            np.array([moved for _, _, moved in rows]),
        )

    def _zero(self) -> Array:
        """What the accelerometers read while nothing pushes, less what turning makes them read."""
        readings = [
            np.array(block.force_m_s2) + block.rate_rad_s**2 * np.array(self._config.imu_position_body_m)
            for _, block in self._blocks
            if max(block.open_shares) < SHUT
        ]
        if len(readings) < LEAST_COASTING:
            raise CalibrationRefusedError("the vehicle never coasted: the accelerometers' zero is not seen")
        return np.asarray(np.median(readings, axis=0))

    def _windows(self) -> list[tuple[float, Sequence[Block]]]:
        found: list[tuple[float, Sequence[Block]]] = []
        window: list[Block] = []
        for t_s, block in self._blocks:
            if block.is_after_gap:
                window = []
            window.append(block)
            if sum(each.span_s for each in window) >= WINDOW_S:
                if max(max(each.open_shares) for each in window) >= SHUT:
                    found.append((t_s, window))
                window = []
        return found

    def _miss(self, window: Sequence[Block], valves: Valves, zero: Array) -> tuple[Array, Array]:
        """Measured less predicted, and measured: change of velocity (body axes) and of rate."""
        columns = self._model.effectiveness()
        push = columns[:2] / self._model.mass_kg
        turn = columns[2] / self._model.inertia_kg_m2
        span_s = np.array([block.span_s for block in window])
        late_s = valves.dead_s - (self._config.open_delay_s - self._config.close_delay_s)
        ends = np.array([block.ends for block in window])
        thrust_s = np.array([block.sagged_shares for block in window]) * span_s[:, None] - late_s * ends
        turned_s = np.array([block.turned_s for block in window])
        first, last = window[0], window[-1]
        # from the mean rate of the first block to that of the last
        spun_s = thrust_s[0] - turned_s[0] + thrust_s[1:-1].sum(axis=0) + turned_s[-1]
        given_rate = float(turn @ (valves.torque * spun_s))
        rate = last.rate_rad_s - first.rate_rad_s
        alpha_s = float(turn @ (valves.torque * thrust_s.sum(axis=0)))
        x, y = self._config.imu_position_body_m
        squared_s = sum(block.rate_rad_s**2 * block.span_s for block in window)
        given = push @ (valves.thrust * thrust_s.sum(axis=0))
        given += np.array([-y, x]) * alpha_s - squared_s * np.array([x, y])
        read = np.array([block.force_m_s2 for block in window]).T @ span_s - zero * span_s.sum()
        moved = np.array([*read, rate])
        return moved - np.array([*given, given_rate]), moved


def as_the_rig_has_it(count: int, config: IdentificationConfig) -> Valves:
    """Every valve as the rig states it."""
    return Valves(np.ones(count), np.ones(count), np.full(count, config.open_delay_s - config.close_delay_s))


def known_or_the_rigs(values: Sequence[float], rigs: Array) -> Array:
    """What was learned, and the rig's where nothing was."""
    return np.array([a if math.isfinite(a) else b for a, b in zip(values, rigs, strict=True)])
