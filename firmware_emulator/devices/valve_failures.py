"""What ails the valves of one vehicle: set in its thruster bank as failures begin and end."""

import math

from drivers.valve_bus.protocol import VALVES, NodeFault
from firmware_emulator.failures import Failure, Failures
from firmware_emulator.plant.rigid_body import Vehicle
from firmware_emulator.plant.thrusters import FAR_FUTURE_NS, NS_PER_S, BankFailures

OPENS_FROM_V = 9.0  # below, a coil does not lift its poppet
_PA_PER_BAR = 1e5


class ValveFailures:
    """Keeps the bank's failures; has moments of its own, since a pulsing valve opens and closes by itself.

    Its first such moment after a failure begins lies 20 ms later at least (`pulsing_valve`), by when its node
    has sent a status and asked for `next_ns`.

    Args:
        vehicle: Whose valves.
        failures: `stuck_open_valve`, `stuck_closed_valve`, `open_coil`, `leaking_valve`, `weak_valve`,
            `pulsing_valve`, `low_tank`, `low_battery`.
        start_ns: Laboratory time that failures count from.

    Attributes:
        next_ns: When a valve next opens or closes by itself.
        node_faults: What the node states about itself.
        coil_mask: Bit i: it sees that the coil of valve i is torn.
    """

    def __init__(self, vehicle: Vehicle, failures: Failures, start_ns: int) -> None:
        self._vehicle, self._failures, self._start_ns = vehicle, failures, start_ns
        self.next_ns = FAR_FUTURE_NS
        self.node_faults = NodeFault(0)
        self.coil_mask = 0
        failures.watch("valves", self._apply)

    def run(self, now_ns: int) -> None:
        """Let valves move that do so by themselves."""
        if self.next_ns <= now_ns:
            self._apply(now_ns)

    def _apply(self, now_ns: int) -> None:
        age_ns = now_ns - self._start_ns
        pulsing = self._active("pulsing_valve", age_ns)
        edges_ns = [_next_edge_ns(failure, age_ns) for failure in pulsing]
        self.next_ns = min((self._start_ns + edge_ns for edge_ns in edges_ns), default=FAR_FUTURE_NS)
        low = self._active("low_battery", age_ns)
        self.node_faults = NodeFault.SUPPLY_UNDERVOLTAGE if low else NodeFault(0)
        stuck_closed = {_valve(failure) for failure in self._active("stuck_closed_valve", age_ns)}
        torn = {_valve(failure) for failure in self._active("open_coil", age_ns)}
        self.coil_mask = sum(1 << valve for valve in torn)
        stuck_closed |= torn
        if any(failure.parameters["battery_v"] < OPENS_FROM_V for failure in low):
            stuck_closed.update(range(VALVES))
        stuck_open = {_valve(failure) for failure in self._active("stuck_open_valve", age_ns)}
        stuck_open.update(_valve(failure) for failure in pulsing if _is_on(failure, age_ns))
        tanks_pa = [f.parameters["tank_bar"] * _PA_PER_BAR for f in self._active("low_tank", age_ns)]
        self._vehicle.advance(now_ns)
        self._vehicle.thrusters.set_failures(
            BankFailures(
                stuck_open=frozenset(stuck_open),
                stuck_closed=frozenset(stuck_closed),
                leaks={_valve(f): f.parameters["fraction"] for f in self._active("leaking_valve", age_ns)},
                thrust_left={_valve(f): f.parameters["fraction"] for f in self._active("weak_valve", age_ns)},
                tank_limit_pa=min(tanks_pa, default=math.inf),
            )
        )

    def _active(self, kind: str, age_ns: int) -> list[Failure]:
        return self._failures.all_active(kind, age_ns)


def _valve(failure: Failure) -> int:
    return int(failure.parameters["valve"])


def _period_and_on_ns(failure: Failure) -> tuple[int, int]:
    return round(failure.parameters["period_s"] * NS_PER_S), round(failure.parameters["on_s"] * NS_PER_S)


def _is_on(failure: Failure, age_ns: int) -> bool:
    period_ns, on_ns = _period_and_on_ns(failure)
    return (age_ns - failure.start_ns) % period_ns < on_ns


def _next_edge_ns(failure: Failure, age_ns: int) -> int:
    """When the valve next opens or closes; counted as the failure's own times are."""
    period_ns, on_ns = _period_and_on_ns(failure)
    whole, phase_ns = divmod(age_ns - failure.start_ns, period_ns)
    return failure.start_ns + whole * period_ns + (on_ns if phase_ns < on_ns else period_ns)
