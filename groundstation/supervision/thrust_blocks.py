"""IMU samples and commanded pulses, averaged side by side over blocks of 20 ms."""

import math
from dataclasses import dataclass

from groundstation.control.sag import sag_factor
from groundstation.control.valve_push import ValvePush
from groundstation.control.vehicle import VehicleModel

KEPT_NS = 300_000_000
"""Samples older than this are not laid beside pulses: the longest way of a sample to here."""
_NO_THRUST = 1e-4  # a decayed share this small is none


@dataclass(slots=True)
class Block:
    """Means over some 20 ms.

    Attributes:
        span_s: Length of the block, of samples only.
        rate_rad_s: Turn rate as measured, bias removed by the caller.
        force_m_s2: Specific force x, y as measured, body axes.
        open_shares: Share of full thrust of each valve as its commands have it, as accelerometers feel it.
        rate_shares: The same as the gyro feels it.
        ends: Of each valve, how many ends of thrust lie in the block (a part counts as a part).
        edges: Of each valve, starts and ends.
        sagged_shares: As `open_shares`, less what the supply's sag takes.
        crowds: How much those grow with the sag's factor.
        turned_s: Of each valve, thrust since the block's start as the gyro feels it, mean over the block.
        is_after_gap: Whether samples are missing before it.
    """

    span_s: float
    rate_rad_s: float
    force_m_s2: tuple[float, float]
    open_shares: list[float]
    rate_shares: list[float]
    ends: list[float]
    edges: list[float]
    sagged_shares: list[float]
    crowds: list[float]
    turned_s: list[float]
    is_after_gap: bool


@dataclass(slots=True)
class _Sums:
    span_s: float
    rate: float
    force_x: float
    force_y: float
    is_after_gap: bool
    open_shares: list[float]
    rate_shares: list[float]
    ends: list[float]
    edges: list[float]
    sagged: list[float]
    crowds: list[float]
    moments: list[float]


class _Lag:
    """A first-order lag's response to an input that is constant over each step."""

    __slots__ = ("_left", "_mean", "_span_s", "_tau_s", "value")

    def __init__(self, tau_s: float) -> None:
        self._tau_s, self.value = tau_s, 0.0
        self._span_s, self._left, self._mean = 0.0, 0.0, 0.0

    def step(self, target: float, span_s: float) -> float:
        """Mean of the output over the step."""
        if self._tau_s <= 0.0:
            self.value = target
            return target
        if span_s != self._span_s:
            self._span_s, self._left = span_s, math.exp(-span_s / self._tau_s)
            self._mean = (1.0 - self._left) * self._tau_s / span_s
        excess = self.value - target
        self.value = target + excess * self._left
        return target + excess * self._mean


class ThrustBlocks:
    """Makes blocks.

    Args:
        model: Where the valves push.
        delays_s: From command to thrust, and from the end of an on-time to none.
        rise_s: Time constant of the thrust.
        lags_s: Of the accelerometers' and of the gyro's low-pass.
        block_s: Length of a block.
        sag: Factor of thrust per further open valve.
        step_s: Longest step of the lags. A sample's window may be longer than a pulse, whose two edges one
            step would take for a part of one.
    """

    def __init__(
        self,
        model: VehicleModel,
        delays_s: tuple[float, float],
        rise_s: float,
        lags_s: tuple[float, float],
        block_s: float,
        sag: float = 1.0,
        step_s: float = math.inf,
    ) -> None:
        self._sag, self._step_s = sag, step_s
        self._model, self._delays_s, self._block_s = model, delays_s, block_s
        self._count = len(model.valves)
        self._rise_s, (self._acc_lag_s, self._gyro_lag_s) = rise_s, lags_s
        self.reset()

    def reset(self) -> None:
        """Forget samples and pulses."""
        self._push = ValvePush(self._model, *self._delays_s, kept_ns=KEPT_NS)
        self._rise = [_Lag(self._rise_s) for _ in range(self._count)]
        self._acc = [_Lag(self._acc_lag_s) for _ in range(self._count)]
        self._gyro = [_Lag(self._gyro_lag_s) for _ in range(self._count)]
        self._live: set[int] = set()
        self._last_ns: int | None = None
        self._sums = self._empty(is_after_gap=True)

    def command(self, now_ns: int, pulse_id: int, on_time_ms: bytes | tuple[int, ...]) -> None:
        """Take what the guard lets through, at the moment it is sent."""
        self._push.command(now_ns, pulse_id, on_time_ms)

    def sample(
        self, stamp_ns: int, window_s: float, rate_rad_s: float, force_m_s2: tuple[float, float]
    ) -> Block | None:
        """Take a sample; the block that it completes, if it does.

        Args:
            stamp_ns: End of its window.
            window_s: Length of its window.
            rate_rad_s: Turn rate.
            force_m_s2: Specific force x, y, body axes.
        """
        start_ns = stamp_ns - round(window_s * 1e9)
        if self._last_ns is not None and start_ns - self._last_ns > 0.5e9 * window_s:
            # the lags see the gap as one step; a block over a gap would stand for nothing whole
            self._respond(self._last_ns, start_ns, None)
            self._sums = self._empty(is_after_gap=True)
        self._last_ns = stamp_ns
        sums = self._sums
        sums.span_s += window_s
        sums.rate += window_s * rate_rad_s
        sums.force_x += window_s * force_m_s2[0]
        sums.force_y += window_s * force_m_s2[1]
        self._respond(start_ns, stamp_ns, sums)
        if sums.span_s < self._block_s - 0.5 * window_s:
            return None
        self._sums = self._empty(is_after_gap=False)
        return _block(sums)

    def _respond(self, start_ns: int, stop_ns: int, sums: _Sums | None) -> None:
        """Let the lags follow the commands over a span; add what sensors feel to the sums."""
        steps = 1 if sums is None else math.ceil((stop_ns - start_ns) * 1e-9 / self._step_s - 1e-6) or 1
        began_s = 0.0 if sums is None else sums.span_s - (stop_ns - start_ns) * 1e-9
        for step in range(steps):
            from_ns = start_ns + (stop_ns - start_ns) * step // steps
            to_ns = start_ns + (stop_ns - start_ns) * (step + 1) // steps
            self._step(from_ns, to_ns, sums, began_s + 0.5e-9 * (from_ns + to_ns - 2 * start_ns))

    def _step(self, start_ns: int, stop_ns: int, sums: _Sums | None, middle_s: float) -> None:
        """One step of the lags; its middle counts from the block's start."""
        targets: dict[int, float] = {}
        for valve, share in self._push.open_shares(start_ns, stop_ns):
            targets[valve] = targets.get(valve, 0.0) + share
        if not targets and not self._live:
            return
        span_s = (stop_ns - start_ns) * 1e-9
        felt_all: list[tuple[int, float]] = []
        for valve in self._live.union(targets):
            acc = self._acc[valve]
            before = acc.value
            thrust = self._rise[valve].step(targets.get(valve, 0.0), span_s)
            felt = acc.step(thrust, span_s)
            turned = self._gyro[valve].step(thrust, span_s)
            change = acc.value - before
            if sums is not None:
                sums.open_shares[valve] += span_s * felt
                sums.rate_shares[valve] += span_s * turned
                sums.edges[valve] += abs(change)
                sums.moments[valve] += span_s * turned * middle_s
                felt_all.append((valve, felt))
                if change < 0.0:
                    sums.ends[valve] -= change
            if valve in targets or acc.value > _NO_THRUST or self._rise[valve].value > _NO_THRUST:
                self._live.add(valve)
            else:
                self._live.discard(valve)
        if sums is not None:
            crowd = sum(felt for _, felt in felt_all)
            factor = sag_factor(crowd, self._sag)
            growth = max(0.0, crowd - 1.0) * factor / self._sag
            for valve, felt in felt_all:
                sums.sagged[valve] += span_s * felt * factor
                sums.crowds[valve] += span_s * felt * growth

    def _empty(self, *, is_after_gap: bool) -> _Sums:
        lists = ([0.0] * self._count for _ in range(7))
        return _Sums(0.0, 0.0, 0.0, 0.0, is_after_gap, *lists)


def _block(sums: _Sums) -> Block:
    span_s = sums.span_s
    return Block(
        span_s,
        sums.rate / span_s,
        (sums.force_x / span_s, sums.force_y / span_s),
        [share / span_s for share in sums.open_shares],
        [share / span_s for share in sums.rate_shares],
        sums.ends,
        sums.edges,
        [share / span_s for share in sums.sagged],
        [crowd / span_s for crowd in sums.crowds],
        [turned - moment / span_s for turned, moment in zip(sums.rate_shares, sums.moments, strict=True)],
        sums.is_after_gap,
    )
