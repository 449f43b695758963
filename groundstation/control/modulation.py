"""Pulse modulation: a wrench demand becomes valve on-times that real valves can follow.

A solenoid needs some milliseconds to open, others to close, and below a least on-time it gives nothing that
one could count on. What a period cannot deliver is carried to the next (first-order sigma-delta, per wrench
axis rather than per valve: a demand that changes sign cancels the carried rest instead of firing both sides).
The impulse of a pulse is thrust times (on-time - opening delay + closing delay).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from groundstation.control.allocation import Allocator
from groundstation.control.state import BodyWrench
from groundstation.control.wrench_envelope import WrenchEnvelope

MS_PER_S = 1000.0
MAX_ON_MS = 127  # seven bits on the wire
CARRIED_PULSES = 3.0  # at most three valves of a sparse plan can wait below the least on-time


class PulseConfig(BaseModel):
    """How the valves are driven.

    The period should be a multiple of the bus period (20 ms), for that is when a pulse can start.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    period_s: float = Field(default=0.1, ge=0.02, le=0.12)
    min_on_s: float = Field(default=0.010, ge=0.001, le=0.05)
    min_off_s: float = Field(default=0.010, ge=0.0, le=0.05)
    open_delay_s: float = Field(default=0.006, ge=0.0, le=0.05)
    close_delay_s: float = Field(default=0.005, ge=0.0, le=0.05)

    @model_validator(mode="after")
    def _fits(self) -> "PulseConfig":
        if self.min_on_s + self.min_off_s > self.period_s:
            raise ValueError(f"min_on_s + min_off_s must fit into period_s = {self.period_s}")
        return self


@dataclass(frozen=True, slots=True)
class Pulses:
    """What to send at the start of a period.

    Attributes:
        on_time_ms: Per valve, 0 to close it, otherwise from the least on-time to `MAX_ON_MS`; longer than the
            period means: stay open until the next command decides.
        delivered: Mean wrench over the period that these pulses are expected to give.
        open_valve_s: Sum of the expected open times, the gas in valve seconds.
    """

    on_time_ms: tuple[int, ...]
    delivered: BodyWrench
    open_valve_s: float


class PulseModulator:
    """Turns one demand per period into on-times; carries what could not be delivered."""

    def __init__(self, allocator: Allocator, config: PulseConfig) -> None:
        self.config = config
        self._allocator = allocator
        self._period_ms = config.period_s * MS_PER_S
        self._min_on_ms = int(np.ceil(config.min_on_s * MS_PER_S - 1e-9))
        self._min_off_ms = config.min_off_s * MS_PER_S
        self._open_ms = config.open_delay_s * MS_PER_S
        self._close_ms = config.close_delay_s * MS_PER_S
        # a valve that stays open gets half a period of grace for a late command, as far as the wire goes
        self._full_ms = min(MAX_ON_MS, int(self._period_ms + max(20.0, self._period_ms / 2.0)))
        effect = np.abs(allocator.effectiveness).max(axis=1)
        self._carry_limit_ms = CARRIED_PULSES * self._min_on_ms * effect
        self.reset()

    @property
    def envelope(self) -> WrenchEnvelope:
        """What the valves can make."""
        return self._allocator.envelope

    def reset(self) -> None:
        """Forget the carried rest; all valves are taken to be closed."""
        self._carried_ms = np.zeros(3)
        self._stays_open = [False] * self._allocator.effectiveness.shape[1]

    def update(self, demand: BodyWrench) -> Pulses:
        """On-times for the period that starts now.

        Args:
            demand: Mean wrench wanted over the period, body axes.
        """
        wanted_ms = np.array((*demand.force_body_n, demand.torque_nm)) * self._period_ms + self._carried_ms
        mean = (wanted_ms / self._period_ms).tolist()
        duty = self._allocator.allocate(BodyWrench((mean[0], mean[1]), mean[2]), sparse=True)
        on_ms: list[int] = []
        open_ms: list[float] = []
        for valve, share in enumerate(duty.tolist()):
            on, opened = self._pulse(share * self._period_ms, self._stays_open[valve])
            on_ms.append(on)
            open_ms.append(opened)
        self._stays_open = [on >= self._period_ms for on in on_ms]
        given_ms: NDArray[np.float64] = self._allocator.effectiveness @ open_ms
        self._carried_ms = np.clip(wanted_ms - given_ms, -self._carry_limit_ms, self._carry_limit_ms)
        given = (given_ms / self._period_ms).tolist()
        return Pulses(tuple(on_ms), BodyWrench((given[0], given[1]), given[2]), sum(open_ms) / MS_PER_S)

    def _pulse(self, wanted_ms: float, is_open: bool) -> tuple[int, float]:
        """On-time for a wanted open time, and the open time that it really gives in this period."""
        opening_ms = 0.0 if is_open else self._open_ms
        on = round(wanted_ms + opening_ms - self._close_ms)
        if wanted_ms <= 0.0 or on < self._min_on_ms:
            # closing an open valve still lets it blow for the closing delay
            return 0, self._close_ms if is_open else 0.0
        if on > self._period_ms - self._min_off_ms:
            return self._full_ms, self._period_ms - opening_ms
        return on, on - opening_ms + self._close_ms
