"""Constants of an IMU tried on a flight that they were not made from: how far does it drift from the fixes?

The filter carries the state with the constants held as they are, and is given a fix only now and then. What a
fix is off by then is the drift since the fix before it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from calibration.imu.joint import WIDE_GATE
from calibration.outcome import CalibrationRefusedError
from calibration.result import Quantity
from groundstation.declarations.fix import PoseFix
from groundstation.declarations.message import Message
from groundstation.declarations.rig import Rig
from groundstation.fusion import error_state as es
from groundstation.fusion.constants import CONSTANTS, OF_THE_DAY
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.noise import NoiseModel
from groundstation.parts.fusion.messages import FixAccount
from groundstation.parts.fusion.part import fusion_node

GAP_S = 3.0
"""So long it is carried without a fix."""
SETTLE_S = 6.0
"""Until then each fix is given: pose and velocity become known."""
LEAST = 4
"""Drifts, for a verification that is worth its name."""

NO_SIGMA = 1e-9
BIASES = {
    "gyro_bias": "gyro_temperature_slope",
    "acc_bias_x": "acc_x_temperature_slope",
    "acc_bias_y": "acc_y_temperature_slope",
}
Array = NDArray[np.float64]
Received = tuple[Message, int]
"""A message, and when it arrived."""


@dataclass(frozen=True, slots=True, eq=False)
class Carried:
    """What was found.

    Attributes:
        off: (n, 4) exposure s, and by how much fix and carried state differ in x, y (m) and heading (rad).
        nis: (n,) the same in squared sigmas; 3 is expected.
    """

    off: Array
    nis: Array

    @property
    def rms(self) -> Array:
        """(3,) of x, y, heading."""
        return np.asarray(np.sqrt((self.off[:, 1:] ** 2).mean(axis=0)))


def carried(rig: Rig, vehicle: str, received: Iterable[Received], noise: NoiseModel) -> Carried:
    """Carry a vehicle through a flight.

    Args:
        rig: Of the flight.
        vehicle: Which one.
        received: What its fusion was given, in that order.
        noise: With the constants to be tried.

    Raises:
        CalibrationRefusedError: Too few fixes come after a gap.
    """
    node = fusion_node(rig, vehicle, ErrorStateFilter(noise))
    rows: list[tuple[float, ...]] = []
    first_ns = given_ns = 0
    tried: set[int] = set()
    for message, now_ns in received:
        if isinstance(message, PoseFix):
            if not message.fix:
                continue
            first_ns = first_ns or message.stamp_ns
            is_settled = message.stamp_ns - first_ns > SETTLE_S * 1e9
            if is_settled and message.stamp_ns - given_ns < GAP_S * 1e9:
                continue
            if is_settled:
                tried.add(message.stamp_ns)
            given_ns = message.stamp_ns
        for answer in node.receive(message, now_ns):
            if isinstance(answer, FixAccount) and answer.stamp_ns in tried and math.isfinite(answer.nis):
                tried.discard(answer.stamp_ns)
                rows.append((answer.stamp_ns * 1e-9, *answer.innovation, answer.nis))
    if len(rows) < LEAST:
        raise CalibrationRefusedError(
            f"{len(rows)} fixes come {GAP_S:g} s after the one before, {LEAST} are needed"
        )
    table = np.array(rows)
    return Carried(table[:, :4], table[:, 4])


def held(noise: NoiseModel, found: Mapping[str, Quantity]) -> NoiseModel:
    """The model with the constants as they were found, the biases and slopes of the day included."""
    constants = tuple(
        (CONSTANTS[name][0], number.value, number.sigma)
        for name, number in found.items()
        if name in CONSTANTS and math.isfinite(number.sigma)
    )
    return replace(noise, calibrated=constants, gate_nis=WIDE_GATE)


def held_before(noise: NoiseModel, found: Mapping[str, Quantity]) -> NoiseModel:
    """The model with the constants as the rig has them, only what is of the day as it was found."""
    rigs = es.initial_state(noise)
    kept = tuple(
        (k, float(rigs[k]), NO_SIGMA) for name, (k, _) in CONSTANTS.items() if name not in OF_THE_DAY
    )
    of_the_day = {name: number for name, number in found.items() if name in OF_THE_DAY}
    return replace(noise, calibrated=kept + held(noise, of_the_day).calibrated, gate_nis=WIDE_GATE)


def warmed(found: Mapping[str, Quantity], by_c: float) -> dict[str, Quantity]:
    """The same with biases that hold at another temperature, where a flight that is judged begins.

    Args:
        found: Constants; biases are those at the first temperature of their recording.
        by_c: How much warmer it is.
    """
    if not math.isfinite(by_c):
        return dict(found)
    moved = dict(found)
    for bias, slope in BIASES.items():
        at, per_c = found[bias], found[slope]
        sigma = math.hypot(at.sigma, per_c.sigma * by_c)
        moved[bias] = Quantity(at.value + per_c.value * by_c, sigma, at.unit)
    return moved
