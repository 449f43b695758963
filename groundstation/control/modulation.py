"""Pulse modulation: a wrench demand becomes valve on-times that real valves can follow.

A solenoid needs some milliseconds to open, others to close, and below a least on-time it gives nothing that
one could count on. What a period cannot deliver is carried to the next (first-order sigma-delta, per wrench
axis rather than per valve: a demand that changes sign cancels the carried rest instead of firing both sides).
The impulse of a pulse is thrust times (on-time - opening delay + closing delay), less what the regulator's
sag takes, which is carried, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, model_validator

from groundstation.control.allocation import Allocator
from groundstation.control.sag import Span, sagged_spans
from groundstation.control.state import BodyWrench
from groundstation.control.valve_health import ValveHealth
from groundstation.control.wrench_envelope import WrenchEnvelope
from groundstation.files.plain_model import PlainModel

MS_PER_S = 1000.0
MAX_ON_MS = 127  # seven bits on the wire
CARRIED_PULSES = 3.0  # at most three valves of a sparse plan can wait below the least on-time


class PulseConfig(PlainModel):
    """How the valves are driven.

    The period should be a multiple of the bus period (20 ms), for that is when a pulse can start.

    Attributes:
        sag: Factor of thrust per further open valve; 1 where the supply does not sag.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    period_s: float = Field(default=0.1, ge=0.02, le=0.12)
    min_on_s: float = Field(default=0.010, ge=0.001, le=0.05)
    min_off_s: float = Field(default=0.010, ge=0.0, le=0.05)
    open_delay_s: float = Field(default=0.006, ge=0.0, le=0.05)
    close_delay_s: float = Field(default=0.005, ge=0.0, le=0.05)
    sag: float = Field(default=1.0, gt=0.5, le=1.0)

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
        open_valve_s: Gas, in seconds of one healthy valve of mean thrust.
    """

    on_time_ms: tuple[int, ...]
    delivered: BodyWrench
    open_valve_s: float


class PulseModulator:
    """Turns one demand per period into on-times; carries what could not be delivered."""

    def __init__(self, allocator: Allocator, config: PulseConfig) -> None:
        self.config = config
        self._period_ms = config.period_s * MS_PER_S
        self._min_on_ms = int(np.ceil(config.min_on_s * MS_PER_S - 1e-9))
        self._min_off_ms = config.min_off_s * MS_PER_S
        self._open_ms = config.open_delay_s * MS_PER_S
        self._close_ms = config.close_delay_s * MS_PER_S
        # a valve that stays open gets half a period of grace for a late command, as far as the wire goes
        self._full_ms = min(MAX_ON_MS, int(self._period_ms + max(20.0, self._period_ms / 2.0)))
        self._allocator = allocator
        self.reset()

    @property
    def envelope(self) -> WrenchEnvelope:
        """What the valves can make."""
        return self._allocator.envelope

    def reset(self) -> None:
        """Forget the carried rest; all valves are taken to be closed."""
        self._carried_ms = np.zeros(3)
        self._stays_open = [False] * self._allocator.effectiveness.shape[1]

    @property
    def allocator(self) -> Allocator:
        """By which demands are shared now."""
        return self._allocator

    def take_health(self, health: Sequence[ValveHealth] | None) -> None:
        """Share by what valves give from the next period on; the carried rest is kept.

        Raises:
            ValueError: There are not as many states of health as valves.
        """
        self._allocator = self._allocator.with_health(health)
        self._stays_open = [
            stays and obeys for stays, obeys in zip(self._stays_open, self._allocator.obeys, strict=True)
        ]

    def update(self, demand: BodyWrench) -> Pulses:
        """On-times for the period that starts now.

        Args:
            demand: Mean wrench wanted over the period, body axes.
        """
        allocator = self._allocator
        wanted_ms = np.array((*demand.force_body_n, demand.torque_nm)) * self._period_ms + self._carried_ms
        mean = (wanted_ms / self._period_ms).tolist()
        duty = allocator.allocate(BodyWrench((mean[0], mean[1]), mean[2]), sparse=True)
        pulses = [
            self._pulse(share * self._period_ms, self._stays_open[valve])
            for valve, share in enumerate(duty.tolist())
        ]
        self._stays_open = [on >= self._period_ms for on, _ in pulses]
        open_ms, idle_ms = self._effective_ms([span for _, span in pulses])
        given_ms: NDArray[np.float64] = allocator.effectiveness @ open_ms + allocator.offset * idle_ms
        limit_ms = CARRIED_PULSES * self._min_on_ms * np.abs(allocator.effectiveness).max(axis=1)
        self._carried_ms = np.clip(wanted_ms - given_ms, -limit_ms, limit_ms)
        given = (given_ms / self._period_ms).tolist()
        gas_ms = float(allocator.flow @ open_ms) + allocator.idle_flow * idle_ms
        delivered = BodyWrench((given[0], given[1]), given[2])
        return Pulses(tuple(on for on, _ in pulses), delivered, gas_ms / MS_PER_S)

    def _effective_ms(self, spans: list[Span]) -> tuple[list[float], float]:
        """Open times that give as much at full supply, of each valve and of those that do not shut."""
        if self.config.sag == 1.0:
            return [end - begin for begin, end in spans], self._period_ms
        allocator = self._allocator
        return sagged_spans(
            spans, allocator.open_shares, allocator.shut_shares, self._period_ms, self.config.sag
        )

    def _pulse(self, wanted_ms: float, is_open: bool) -> tuple[int, Span]:
        """On-time for a wanted open time, and when the valve is really open, from the period's start."""
        opening_ms = 0.0 if is_open else self._open_ms
        on = round(wanted_ms + opening_ms - self._close_ms)
        if wanted_ms <= 0.0 or on < self._min_on_ms:
            # closing an open valve still lets it blow for the closing delay
            return 0, (0.0, self._close_ms if is_open else 0.0)
        if on > self._period_ms - self._min_off_ms:
            return self._full_ms, (opening_ms, self._period_ms)
        return on, (opening_ms, on + self._close_ms)
