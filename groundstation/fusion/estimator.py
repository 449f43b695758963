"""The contract of every fusion estimator, and the small records that go in and come out.

Stamps are int nanoseconds of one host's monotonic clock. Positions, headings and velocities are those of the
centre of mass in the table frame; packets are in the body frame at the accelerometers. The records are named
tuples because a thousand of them a second are made.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.noise import NoiseModel

Array = NDArray[np.float64]
Pair = tuple[float, float]

WAITS = "waits for packets"
"""Reason of an account that is not the last word: another one follows by `Estimator.settled`."""


class ImuPacket(NamedTuple):
    """Mean of the polls of one averaging window, body frame."""

    t_ns: int
    """End of the window."""
    dt_s: float
    """Since the end of the last packet, by the sensor's ticks; over one window where packets were lost."""
    rate_rad_s: float
    ax_m_s2: float
    ay_m_s2: float
    temperature_c: float
    """NaN where the block does not send it."""


class Fix(NamedTuple):
    """Pose of the body's origin from one image."""

    t_exposure_ns: int
    """Middle of the exposure."""
    t_arrival_ns: int
    x_m: float
    y_m: float
    heading_rad: float
    covariance: Array
    """(3, 3) of x, y, heading; m^2, m rad, rad^2."""
    source: str = "stars"
    """Who made it; the exposures of one source never go back."""


class PlanarState(NamedTuple):
    """State of the centre of mass at the end of a packet, table frame."""

    t_ns: int
    x_m: float
    y_m: float
    heading_rad: float
    """Not wrapped: continuous over turns."""
    vx_m_s: float
    vy_m_s: float
    rate_rad_s: float
    bias_rate_rad_s: float
    bias_ax_m_s2: float
    """To be taken from the accelerometer: its bias minus the slope's gravity in body axes."""
    bias_ay_m_s2: float
    sigma_x_m: float
    sigma_y_m: float
    sigma_heading_rad: float
    is_lost: bool
    """True until two fixes agree, and again when fixes in a row contradict the estimate."""


class FixOutcome(NamedTuple):
    """What became of one fix."""

    t_exposure_ns: int
    used: bool
    reason: str
    innovation_x_m: float
    innovation_y_m: float
    innovation_heading_rad: float
    nis: float
    """Normalised innovation squared, 3 degrees of freedom."""
    source: str = "stars"
    """Of the fix."""


class Counters:
    """What an estimator met and survived, by name; shown to the operator."""

    __slots__ = ("by_name",)

    def __init__(self) -> None:
        self.by_name: dict[str, int] = {}

    def add(self, name: str, count: int = 1) -> None:
        """Count one more of `name`, or several."""
        self.by_name[name] = self.by_name.get(name, 0) + count


class Estimator(Protocol):
    """IMU packets and late fixes in, state of the centre of mass out; no clock of its own."""

    counters: Counters

    def begin_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle stands still (landed, or held)."""

    def end_rest(self, t_ns: int) -> None:
        """Say that from this stamp the vehicle may move."""

    def add_imu(self, packet: ImuPacket) -> PlanarState | None:
        """Take one packet; None as long as no fix has given a pose, or when the packet was refused."""

    def add_fix(self, fix: Fix) -> FixOutcome:
        """Take a fix, at its arrival."""

    def settled(self) -> list[FixOutcome]:
        """Hand over the accounts of fixes that had to wait for packets, once each."""

    def state(self) -> PlanarState | None:
        """Return the state after the newest packet."""

    def covariance(self) -> Array:
        """Return (6, 6) of x, y, heading, vx, vy, rate at the newest packet, centre of mass."""

    def doubt_forces(self, t_ns: int, *, x: bool, y: bool) -> None:
        """Say which accelerometers are not believed from this stamp on; readings are made up meanwhile."""

    def expected_forces(self, rate_rad_s: float, push_m_s2: Pair, turn_rad_s2: float) -> Pair:
        """Return what the accelerometers would read under a known push.

        Args:
            rate_rad_s: the gyro's reading.
            push_m_s2: acceleration of the centre of mass by the valves, body axes.
            turn_rad_s2: angular acceleration by the valves.
        """

    def slope_left(self) -> tuple[float, float]:
        """Return the table's pull (x, y, m/s^2) believed beyond a map; zeros where none is estimated."""


class EstimatorFactory(Protocol):
    """How a row of the table of estimators is made."""

    def __call__(self, noise: NoiseModel) -> Estimator:
        """Return a fresh estimator."""
