"""What is known of a vehicle and its neighbours at a moment, and what is wrong with it. Pure.

Ages are judged by arrivals against the moment of the question, never by stamps inside messages.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from drivers.quick_record import quickly_made
from groundstation.control.corridor import Docking, may_touch
from groundstation.control.edge import EdgeVerdict, edge_outlook
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import ControlState
from groundstation.supervision.clearance import clearance

NS_PER_S = 1_000_000_000
STATE_S, NODE_S, FINDINGS_S, RECORDER_S, OTHER_S = 0.3, 0.5, 1.0, 2.0, 1.0
"""After so long without news, state, valve node, fault detector, recorder or another vehicle are silent."""
FORGETTING_S = 0.5
"""Memory that cannot be written is tried ten times a second."""
FRESH_S = 0.1
"""An older status says nothing about an order that was just given."""
STARTING_S = 10.0
"""So long processes may take to start before their silence on the ground is a fault."""
LATE_TICK_S = 0.1
STOOD_STILL_S = 1.0
CONTROLLER_S = 0.5
LARGEST_SIGMA_M, LARGEST_SIGMA_RAD = 0.05, math.radians(5.0)
LEAST_BRAKING_M_S2 = 0.005
"""With less no push could be braked on a table; a sixth of what healthy valves give."""
LEAST_TANK_PA = 30e5
LEAST_ROOM_S = 60.0
REST_SPEED_M_S, REST_RATE_RAD_S = 0.012, math.radians(3.0)
"""Slower than this counts as at rest: the estimate's own noise, and what dry friction takes at once."""
OVERHANG_M = 0.05
"""So far beyond its part of the table a predicted stop may lie before the air is cut: noise."""
REACTION_S = 0.15
"""Age of the state, a modulation period, the opening of a valve."""
ONLY_ALOFT = frozenset(
    {
        "star_outage",
        "fixes_rare",
        "wrong_fixes",
        "pushed",
        "valve_stuck_open",
        "valve_stuck_closed",
        "valve_weak",
    }
)
"""What is found by how it moves means nothing on the ground, where people lift it and friction holds it."""
UNDERVOLTAGE, COIL_FAULT = 1, 0x80
"""Fault bits of the valve node: the lowest, and the one by which the station says that a coil is reported."""


@quickly_made
@dataclass(frozen=True, slots=True)
class Seen:
    """The newest estimate of a vehicle, as it arrived.

    Attributes:
        arrival_ns: When.
        state: Where it is and how it moves; the last good one where the estimator is lost.
        status: Of the estimator.
        sigma: Standard deviations of x, y (m) and heading (rad).
    """

    arrival_ns: int
    state: ControlState
    status: str
    sigma: tuple[float, float, float]


@quickly_made
@dataclass(frozen=True, slots=True)
class NodeSeen:
    """The newest status of the valve node, as it arrived, and how many frames a second its bus carries."""

    arrival_ns: int
    armed: bool
    floating: bool
    dead_man: bool
    pressure_pa: float
    faults: int
    bus_rate_hz: float = 0.0


@dataclass(slots=True)
class Sightings:
    """Everything that a supervisor looks at; the node keeps it up to date.

    Attributes:
        keep_in: Part of the table for the centres of mock-ups.
        braking_m_s2: Deceleration to count on, with the valves that work.
        radius_m: Of a mock-up.
        began_ns: When the supervisor began: nothing is silent before its time.
        most_frames_hz: Frames a second of which the bus is flooded.
        own: The newest estimate; None before the first.
        placed_ns: Since when the estimator places it without a break; None while it does not.
        others: Those of the other vehicles.
        leaders: Names of vehicles whose states its controller wants.
        name: Of this vehicle.
        dockings: Pairs of the rig that may touch, each inside its corridor.
        node: The newest status of its valve node; None before the first.
        findings: What the fault detector found, by id with details.
        findings_ns: Arrival of these.
        fix_age_s: Since the exposure of the newest used fix.
        agreeing: How many fixes were used since the last one that was refused.
        rest_s: Length of its unbroken rest.
        recorder_ns: Arrival of the recorder's newest status; None where none was ever received.
        recorder_room_s: How long the recording can go on by the room on its disk.
        demand_ns: Arrival of the controller's newest demand; None where none was ever received.
        outside_trouble: Whose program outside has the vehicle and is silent, and why; empty where none is.
        memory_trouble: Why the memory could not be written; empty if it never failed.
        memory_ns: When that was reported last.
        tick_ns: When the supervisor looked last.
        late_s: How late it looked now.
        missing_thrust: What the valves that work cannot make; empty where they suffice to fly.
    """

    keep_in: KeepIn
    braking_m_s2: float
    radius_m: float
    began_ns: int
    most_frames_hz: float = math.inf
    own: Seen | None = None
    placed_ns: int | None = None
    others: dict[str, Seen] = field(default_factory=dict)
    leaders: tuple[str, ...] = ()
    name: str = ""
    dockings: tuple[Docking, ...] = ()
    node: NodeSeen | None = None
    findings: Mapping[str, str] = field(default_factory=dict)
    findings_ns: int | None = None
    fix_age_s: float = math.inf
    agreeing: int = 0
    rest_s: float = 0.0
    recorder_ns: int | None = None
    recorder_room_s: float = math.inf
    demand_ns: int | None = None
    outside_trouble: str = ""
    memory_trouble: str = ""
    memory_ns: int = 0
    tick_ns: int | None = None
    late_s: float = 0.0
    missing_thrust: str = ""

    def look(self, now_ns: int, period_ns: int) -> None:
        """Note the moment: how much later it is than it should be."""
        if self.tick_ns is not None:
            self.late_s = (now_ns - self.tick_ns - period_ns) / NS_PER_S
        self.tick_ns = now_ns

    def see_own(self, seen: Seen) -> None:
        """Take the newest estimate of the vehicle itself."""
        self.own = seen
        if seen.status != "flying":
            self.placed_ns = None
        elif self.placed_ns is None:
            self.placed_ns = seen.arrival_ns

    @property
    def is_at_rest(self) -> bool:
        """Whether the newest estimate shows neither speed nor turn."""
        own = self.own
        if own is None:
            return False
        speed_m_s = math.hypot(*own.state.velocity_table_m_s)
        return speed_m_s < REST_SPEED_M_S and abs(own.state.rate_rad_s) < REST_RATE_RAD_S

    def is_silent(self, arrival_ns: int | None, limit_s: float, now_ns: int) -> bool:
        """Whether nothing has arrived for too long, counted from the beginning before the first arrival."""
        last_ns = self.began_ns if arrival_ns is None else arrival_ns
        return now_ns - last_ns > limit_s * NS_PER_S

    def is_state_silent(self, now_ns: int) -> bool:
        """Whether the newest estimate is too old to fly by."""
        return self.is_silent(None if self.own is None else self.own.arrival_ns, STATE_S, now_ns)

    def is_controller_silent(self, now_ns: int, limit_s: float = CONTROLLER_S) -> bool:
        """Whether the controller demands nothing although there is a state to control."""
        if self.placed_ns is None or self.is_state_silent(now_ns):
            return False
        last_ns = self.placed_ns if self.demand_ns is None else max(self.demand_ns, self.placed_ns)
        return self.is_silent(last_ns, limit_s, now_ns)

    def is_node_silent(self, now_ns: int) -> bool:
        """Whether the valve node is silent."""
        return self.is_silent(None if self.node is None else self.node.arrival_ns, NODE_S, now_ns)

    def others_here(self, now_ns: int) -> dict[str, ControlState]:
        """States of the other vehicles that are not too old to brake for."""
        horizon_ns = now_ns - round(OTHER_S * NS_PER_S)
        return {name: seen.state for name, seen in self.others.items() if seen.arrival_ns >= horizon_ns}

    def found(self, now_ns: int, *, is_grounded: bool, is_aloft: bool, may_open: bool) -> dict[str, str]:
        """Faults seen at this moment, by id with details.

        Args:
            now_ns: The moment.
            is_grounded: The air is off and known to be: who has just begun may still be silent.
            is_aloft: The float air is on, or about to be: what concerns motion is looked at, too.
            may_open: The guard is armed and the valve node should be.
        """
        found = {
            fault: detail for fault, detail in self.findings.items() if is_aloft or fault not in ONLY_ALOFT
        }
        if not is_grounded or now_ns - self.began_ns > STARTING_S * NS_PER_S:
            found.update(self._silences(now_ns, is_grounded=is_grounded))
        found.update(self._station(now_ns))
        found.update(self._supplies())
        if self.is_controller_silent(now_ns):
            found["controller_silent"] = _age("demand", self.demand_ns, now_ns)
        if is_aloft:
            found.update(self._thrust())
            found.update(self._motion(now_ns))
            found.update(self._estimate())
            found.update(self._obedience(now_ns, may_open=may_open))
        return found

    def _silences(self, now_ns: int, *, is_grounded: bool) -> Iterator[tuple[str, str]]:
        if self.is_state_silent(now_ns) and (self.own is not None or not is_grounded):
            yield "state_silent", _age("state", None if self.own is None else self.own.arrival_ns, now_ns)
        if self.is_node_silent(now_ns):
            yield "can_silent", _age("status", None if self.node is None else self.node.arrival_ns, now_ns)
        if self.is_silent(self.findings_ns, FINDINGS_S, now_ns):
            yield "detector_silent", _age("findings", self.findings_ns, now_ns)
        if self.recorder_ns is not None and self.is_silent(self.recorder_ns, RECORDER_S, now_ns):
            yield "recorder_down", _age("status", self.recorder_ns, now_ns)
        elif self.recorder_room_s < LEAST_ROOM_S:
            room_s = self.recorder_room_s
            yield "disk_low", f"room for {room_s:.0f} s" if room_s else "it is full: nothing is recorded"
        for name in self.leaders:
            seen = self.others.get(name)
            if seen is not None and self.is_silent(seen.arrival_ns, OTHER_S, now_ns):
                yield "leader_old", f"{name}: {_age('state', seen.arrival_ns, now_ns)}"

    def _station(self, now_ns: int) -> Iterator[tuple[str, str]]:
        if self.memory_trouble and now_ns - self.memory_ns < FORGETTING_S * NS_PER_S:
            yield "memory_lost", self.memory_trouble
        if self.late_s < -0.5 or self.late_s > STOOD_STILL_S:
            yield "clock_jumped", f"by {self.late_s:+.2f} s"
        elif self.late_s > LATE_TICK_S:
            yield "cpu_starved", f"looked {1e3 * self.late_s:.0f} ms late"

    def _supplies(self) -> Iterator[tuple[str, str]]:
        node = self.node
        if node is None:
            return
        if node.pressure_pa < LEAST_TANK_PA:  # NaN: it has no sensor
            yield "tank_low", f"{node.pressure_pa * 1e-5:.0f} bar"
        if node.bus_rate_hz > self.most_frames_hz:
            yield "can_flooded", f"{node.bus_rate_hz:.0f} frames a second"
        if node.faults & UNDERVOLTAGE:
            yield "battery_low", "the valve node reports undervoltage"
        if node.faults & COIL_FAULT:
            yield "coil_fault", "the valve node reports an open or shorted coil"

    def _thrust(self) -> Iterator[tuple[str, str]]:
        if self.missing_thrust:
            yield "thrust_missing", self.missing_thrust
        elif self.braking_m_s2 < LEAST_BRAKING_M_S2:
            yield "thrust_missing", f"{1e3 * self.braking_m_s2:.1f} mm/s^2 to brake with"

    def _motion(self, now_ns: int) -> Iterator[tuple[str, str]]:
        own = self.own
        if own is None or own.status != "flying" or self.is_state_silent(now_ns):
            return
        outlook = edge_outlook(own.state, self.keep_in, self.braking_m_s2, reaction_s=REACTION_S)
        if outlook.room_m < -OVERHANG_M:
            beyond = f"it would stop {-1e3 * outlook.room_m:.0f} mm beyond"
            can_brake = self.braking_m_s2 >= LEAST_BRAKING_M_S2
            yield "edge_unavoidable", beyond if can_brake else "there is nothing left to brake with"
        elif outlook.verdict is not EdgeVerdict.CLEAR:
            yield "edge_ahead", f"it would stop {1e3 * outlook.room_m:.0f} mm before it"
        if not self.others:
            return
        first = clearance(
            own.state,
            self._to_keep_from(own.state, now_ns),
            self.braking_m_s2,
            reaction_s=REACTION_S,
            radius_m=self.radius_m,
        )
        if first.verdict is EdgeVerdict.TOO_LATE:
            yield "vehicle_unavoidable", f"{first.name}: they would overlap by {-1e3 * first.room_m:.0f} mm"
        elif first.verdict is EdgeVerdict.BRAKE:
            yield "vehicle_ahead", f"{first.name}: {1e3 * first.room_m:.0f} mm would be left"

    def _to_keep_from(self, own: ControlState, now_ns: int) -> dict[str, ControlState]:
        """The other vehicles, but for who docks here and is inside its corridor."""
        others = self.others_here(now_ns)
        exempt = may_touch(self.name, self.dockings, {**others, self.name: own})
        return {name: state for name, state in others.items() if name not in exempt}

    def _estimate(self) -> Iterator[tuple[str, str]]:
        own = self.own
        if own is None:
            return
        if own.status == "lost":
            yield "fusion_lost", "the estimator reports it"
        elif max(own.sigma[:2]) > LARGEST_SIGMA_M or own.sigma[2] > LARGEST_SIGMA_RAD:
            x_m, y_m, heading_rad = own.sigma
            yield (
                "position_uncertain",
                f"sigma {1e3 * x_m:.0f} mm, {1e3 * y_m:.0f} mm, {math.degrees(heading_rad):.1f} deg",
            )

    def _obedience(self, now_ns: int, *, may_open: bool) -> Iterator[tuple[str, str]]:
        node = self.node
        if node is not None and may_open and not self.is_silent(node.arrival_ns, FRESH_S, now_ns):
            if node.floating and not node.armed:
                yield "node_disobeys", "it reports that it is disarmed"
            elif node.dead_man:
                yield "node_disobeys", "its dead man has closed the valves"
        if may_open and self.outside_trouble:
            yield "outside_silent", self.outside_trouble


def _age(what: str, arrival_ns: int | None, now_ns: int) -> str:
    if arrival_ns is None:
        return f"no {what} was ever received"
    return f"the newest {what} is {(now_ns - arrival_ns) / NS_PER_S:.1f} s old"
