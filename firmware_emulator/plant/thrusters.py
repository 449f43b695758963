"""Cold-gas valves: coil currents in, forces out.

A valve opens `open_delay` after its coil is energised and closes `close_delay` after it is released; thrust
then follows its target with one time constant, so a pulse gives the impulse F (t_on - t_open + t_close),
and one shorter than the opening delay gives nothing. The regulator sags with every further open valve.

Because all valves share the time constant, the vehicle's wrench is one exponential between two valve
events, and motion under it has a closed form.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

NS_PER_S = 1_000_000_000
FAR_FUTURE_NS = 1 << 62

Wrench = tuple[float, float, float]
"""Force along body x and y in N, torque about the vertical through the centre of mass in N m."""
_NO_WRENCH: Wrench = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Nozzle:
    """Where a valve pushes: position and unit direction of the force, body axes; thrust of this very one."""

    position_body_m: tuple[float, float]
    direction_body: tuple[float, float]
    thrust_n: float

    def wrench(self, centre_of_mass_body_m: tuple[float, float]) -> Wrench:
        """Wrench at full thrust."""
        length = math.hypot(*self.direction_body)
        fx = self.thrust_n * self.direction_body[0] / length
        fy = self.thrust_n * self.direction_body[1] / length
        arm_x = self.position_body_m[0] - centre_of_mass_body_m[0]
        arm_y = self.position_body_m[1] - centre_of_mass_body_m[1]
        return fx, fy, arm_x * fy - arm_y * fx


@dataclass(frozen=True, slots=True)
class ValveTiming:
    """Delays in s (`open_sd_s` from pulse to pulse), and the factor of thrust per further open valve."""

    open_s: float = 0.006
    open_sd_s: float = 0.0005
    close_s: float = 0.005
    rise_s: float = 0.004
    sag: float = 0.97


@dataclass(frozen=True, slots=True)
class GasSupply:
    """Tank and regulator: pressures in Pa, and the impulse in N s that a full tank can give."""

    tank_pa: float = 20e6
    supply_pa: float = 0.6e6
    tank_impulse_n_s: float = 300.0


@dataclass(frozen=True, slots=True)
class BankFailures:
    """What is broken; valves by their index.

    Attributes:
        stuck_open: Valves that are open whatever their coils do.
        stuck_closed: Valves that never open.
        leaks: Share of its thrust that a closed valve loses.
        thrust_left: Share of its thrust that an open valve gives.
        tank_limit_pa: The tank's pressure is no higher.
    """

    stuck_open: frozenset[int] = frozenset()
    stuck_closed: frozenset[int] = frozenset()
    leaks: Mapping[int, float] = field(default_factory=dict)
    thrust_left: Mapping[int, float] = field(default_factory=dict)
    tank_limit_pa: float = math.inf


class ThrusterBank:
    """All valves of one vehicle with their gas.

    Times are int ns of the laboratory. The caller advances in pieces that end at `next_event_ns`, and
    commands only at the time it has reached.
    """

    def __init__(
        self,
        nozzles: Sequence[Nozzle],
        centre_of_mass_body_m: tuple[float, float],
        timing: ValveTiming,
        supply: GasSupply,
        rng: np.random.Generator,
    ) -> None:
        self._wrenches = [nozzle.wrench(centre_of_mass_body_m) for nozzle in nozzles]
        self._thrusts_n = [nozzle.thrust_n for nozzle in nozzles]
        self.timing = timing
        self._supply = supply
        self._rng = rng
        count = len(nozzles)
        self._opens_ns = [FAR_FUTURE_NS] * count  # mechanical opening under way
        self._closes_ns = [FAR_FUTURE_NS] * count  # mechanical closing of a valve that is or will be open
        self._is_open = [False] * count
        self._is_energised = [False] * count
        self._failures = BankFailures()
        self._next_event_ns = FAR_FUTURE_NS
        self._targets: dict[tuple[bool, ...], tuple[Wrench, float]] = {}
        self.wrench: Wrench = (0.0, 0.0, 0.0)
        self.gas_n = 0.0  # sum of all thrusts now
        self.used_impulse_n_s = 0.0
        self.target: Wrench = (0.0, 0.0, 0.0)
        self._target_gas_n = 0.0
        self._retarget()

    @property
    def tank_pa(self) -> float:
        """Pressure left in the tank."""
        left = max(0.0, 1.0 - self.used_impulse_n_s / self._supply.tank_impulse_n_s)
        return min(self._failures.tank_limit_pa, self._supply.tank_pa * left)

    @property
    def supply_pa(self) -> float:
        """Pressure behind the regulator, with the sag of the valves now open."""
        open_valves = sum(self._is_open)
        return min(self._supply.supply_pa, self.tank_pa) * self.timing.sag ** max(0, open_valves - 1)

    @property
    def is_quiet(self) -> bool:
        """Whether no force acts and none is building up."""
        return self.wrench == _NO_WRENCH and self.target == _NO_WRENCH

    @property
    def next_event_ns(self) -> int:
        """When the next valve opens or closes, `FAR_FUTURE_NS` if none will."""
        return self._next_event_ns

    def energise(self, now_ns: int, valve: int) -> None:
        """Current on: the valve opens after its delay, unless released before."""
        if self._is_energised[valve]:
            return
        self._is_energised[valve] = True
        self._closes_ns[valve] = FAR_FUTURE_NS  # a valve caught while closing stays open
        if not self._is_open[valve]:
            delay_s = self.timing.open_s + self.timing.open_sd_s * self._rng.standard_normal()
            self._opens_ns[valve] = now_ns + max(0, round(delay_s * NS_PER_S))
        self._schedule()

    def release(self, now_ns: int, valve: int) -> None:
        """Current off: an open valve closes after its delay, one still opening never opens."""
        if not self._is_energised[valve]:
            return
        self._is_energised[valve] = False
        self._opens_ns[valve] = FAR_FUTURE_NS
        if self._is_open[valve]:
            self._closes_ns[valve] = now_ns + round(self.timing.close_s * NS_PER_S)
        self._schedule()

    def set_failures(self, failures: BankFailures) -> None:
        """Replace what is broken."""
        self._failures = failures
        self._targets.clear()
        self._retarget()

    def pass_events(self, now_ns: int) -> None:
        """Let every valve move that is due at `now_ns`."""
        if self._next_event_ns > now_ns:
            return
        for valve in range(len(self._is_open)):
            if self._opens_ns[valve] <= now_ns:
                self._is_open[valve], self._opens_ns[valve] = True, FAR_FUTURE_NS
            if self._closes_ns[valve] <= now_ns:
                self._is_open[valve], self._closes_ns[valve] = False, FAR_FUTURE_NS
        self._schedule()
        self._retarget()

    def relax(self, duration_s: float) -> None:
        """Let the thrust follow its target for `duration_s` without a valve event."""
        if self.wrench == self.target and self.gas_n == self._target_gas_n:
            self.used_impulse_n_s += self.gas_n * duration_s
            return
        rise_s = self.timing.rise_s
        left = math.exp(-duration_s / rise_s)
        excess_n = self.gas_n - self._target_gas_n
        self.used_impulse_n_s += self._target_gas_n * duration_s + excess_n * rise_s * (1.0 - left)
        fx, fy, torque = self.target
        self.wrench = (
            fx + (self.wrench[0] - fx) * left,
            fy + (self.wrench[1] - fy) * left,
            torque + (self.wrench[2] - torque) * left,
        )
        self.gas_n = self._target_gas_n + excess_n * left
        if self.gas_n < _NO_THRUST_N and self._target_gas_n == 0.0:
            self.wrench, self.gas_n = self.target, 0.0

    def _schedule(self) -> None:
        self._next_event_ns = min(min(self._opens_ns), min(self._closes_ns))

    def _retarget(self) -> None:
        key = tuple(self._is_open)
        if key not in self._targets:
            self._targets[key] = self._target_of(key)
        # The tank empties over minutes, so its pressure may as well be the last valve event's.
        pressure = min(1.0, self.tank_pa / self._supply.supply_pa)
        (fx, fy, torque), gas_n = self._targets[key]
        self.target = (fx * pressure, fy * pressure, torque * pressure)
        self._target_gas_n = gas_n * pressure

    def _target_of(self, is_open: tuple[bool, ...]) -> tuple[Wrench, float]:
        failures = self._failures
        openings = [
            1.0 if valve in failures.stuck_open else 0.0 if valve in failures.stuck_closed else float(opened)
            for valve, opened in enumerate(is_open)
        ]
        openings = [
            max(opening * failures.thrust_left.get(valve, 1.0), failures.leaks.get(valve, 0.0))
            for valve, opening in enumerate(openings)
        ]
        sag = self.timing.sag ** max(0.0, sum(openings) - 1.0)
        fx = fy = torque = gas_n = 0.0
        for opening, (dfx, dfy, dtorque), thrust_n in zip(
            openings, self._wrenches, self._thrusts_n, strict=True
        ):
            fx += sag * opening * dfx
            fy += sag * opening * dfy
            torque += sag * opening * dtorque
            gas_n += sag * opening * thrust_n
        return (fx, fy, torque), gas_n


_NO_THRUST_N = 1e-7  # a decayed thrust this small is none: coasting is cheaper than pushing with it
