"""A mock-up that plays a target which nobody controls: it turns as a tumbling body does, and drifts.

``constant`` turns evenly. ``free`` is a planar cut of a free tumble: Euler's equations of a torque-free body,
I1 w1' = (I2 - I3) w2 w3 and cyclic (L. Landau, E. Lifshitz, Mechanics, section 36), are integrated once; the
table gives the turn about the vertical, so w3 is flown, and the tumble about the other axes is not.
The drift is in the plane and ends where vehicles have to stay inside.
"""

import math
from collections.abc import Mapping
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from groundstation.control.controller import NO_NEIGHBOURS, span_of
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2
from groundstation.control.station import StationConfig, StationKeeping
from groundstation.control.vehicle import VehicleModel
from groundstation.files.plain_model import PlainModel
from groundstation.frames import wrap_angle

FASTEST_DEG_S = 30.0
"""Stars are smeared beyond, and nothing docks to it."""
STEP_S = 0.05
Vector3 = tuple[float, float, float]


class TumbleConfig(PlainModel):
    """How the target moves.

    Attributes:
        mode: ``constant`` or ``free``.
        rate_deg_s: Of the constant turn, counter-clockwise.
        inertia_ratios: Principal moments of inertia about body x, y, z of the body that is played, any unit.
        rates_deg_s: Its turn rates about these axes at the start.
        ramp_s: The turn begins gently over this time.
        span_s: A free tumble is known for so long; then it goes on with the rate that it has.
        drift_m_s: Velocity over the table, (x, y).
        station: Of the law that flies it.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    mode: Literal["constant", "free"] = "constant"
    rate_deg_s: float = Field(default=3.0, ge=-FASTEST_DEG_S, le=FASTEST_DEG_S)
    inertia_ratios: Vector3 = (1.0, 1.4, 1.8)
    rates_deg_s: Vector3 = (2.0, 0.2, 3.0)
    ramp_s: float = Field(default=10.0, ge=1.0, le=120.0)
    span_s: float = Field(default=600.0, ge=1.0, le=3600.0)
    drift_m_s: Vector2 = (0.0, 0.0)
    station: StationConfig = StationConfig()

    @model_validator(mode="after")
    def _is_a_body(self) -> "TumbleConfig":
        least, middle, most = sorted(self.inertia_ratios)
        if not (least > 0.0 and most <= least + middle):
            raise ValueError(
                f"inertia_ratios of a real body are above 0 and none exceeds the sum of the others, "
                f"found {self.inertia_ratios}"
            )
        if not math.hypot(*self.rates_deg_s) <= FASTEST_DEG_S:  # NaN, too
            raise ValueError(f"rates_deg_s may reach {FASTEST_DEG_S:g} deg/s, found {self.rates_deg_s}")
        if not math.hypot(*self.drift_m_s) <= 0.1:
            raise ValueError(f"drift_m_s may reach 0.1 m/s, found {self.drift_m_s}")
        return self


class Tumble:
    """Controller row ``tumble``."""

    def __init__(self, config: TumbleConfig, vehicle: VehicleModel, keep_in: KeepIn | None = None) -> None:
        self._config, self._keep_in = config, keep_in
        self._station = StationKeeping(config.station, vehicle)
        self._times_s, self._rates_rad_s = vertical_rates(config)
        self.reset()

    def reset(self) -> None:
        """Forget the start: the next update begins the tumble where the mock-up is."""
        self._station.reset()
        self._t_s = 0.0
        self._reference: Goal | None = None

    def setpoint(self, goal: Goal) -> Goal:
        """Where the played target is; the goal before the first update."""
        return self._reference or goal

    def update(
        self,
        state: ControlState,
        goal: Goal,
        dt_s: float,
        *,
        applied: BodyWrench | None = None,
        neighbours: Mapping[str, ControlState] = NO_NEIGHBOURS,
    ) -> BodyWrench:
        """See `Controller.update`; goal and neighbours are not looked at."""
        state = state.bounded()
        self._reference = self._moved(state, span_of(dt_s))
        return self._station.update(state, self._reference, dt_s, applied=applied)

    def _moved(self, state: ControlState, dt_s: float) -> Goal:
        before = self._reference or Goal(state.position_table_m, state.heading_rad)
        rate_before, self._t_s = self._rate_rad_s(self._t_s), self._t_s + dt_s
        rate_rad_s = self._rate_rad_s(self._t_s)
        share = min(1.0, self._t_s / self._config.ramp_s)
        velocity = (share * self._config.drift_m_s[0], share * self._config.drift_m_s[1])
        (x, y), wanted = before.position_table_m, velocity
        place = (x + velocity[0] * dt_s, y + velocity[1] * dt_s)
        if self._keep_in is not None and self._keep_in.nearest_inside(place) != place:
            place, wanted = before.position_table_m, (0.0, 0.0)
        return Goal(
            place,
            wrap_angle(before.heading_rad + 0.5 * (rate_before + rate_rad_s) * dt_s),
            wanted,
            rate_rad_s,
            (0.0, 0.0),
            (rate_rad_s - rate_before) / dt_s,
        )

    def _rate_rad_s(self, t_s: float) -> float:
        """Turn about the vertical that is flown, from rest at the start."""
        known = float(np.interp(t_s, self._times_s, self._rates_rad_s))
        return min(1.0, t_s / self._config.ramp_s) * known


def vertical_rates(config: TumbleConfig) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Turn about the vertical over time: s and rad/s, shape (n,) each."""
    if config.mode == "constant":
        return np.zeros(1), np.full(1, math.radians(config.rate_deg_s))
    from scipy.integrate import solve_ivp  # only who tumbles freely has it in memory

    first, second, third = config.inertia_ratios

    def euler(_t_s: float, rate: NDArray[np.float64]) -> tuple[float, float, float]:
        x, y, z = rate.tolist()
        return (
            (second - third) / first * y * z,
            (third - first) / second * z * x,
            (first - second) / third * x * y,
        )

    times_s = np.arange(0.0, config.span_s + STEP_S, STEP_S)
    flown = solve_ivp(
        euler, (0.0, times_s[-1]), np.radians(config.rates_deg_s), "DOP853", times_s, rtol=1e-9, atol=1e-12
    )
    return times_s, np.asarray(flown.y[2], dtype=float)
