"""What is known of a vehicle and its neighbours at a moment. Pure.

Ages are judged by arrivals against the moment of the question, never by stamps inside messages.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from drivers.quick_record import quickly_made
from groundstation.control.corridor import Docking
from groundstation.control.keep_in import KeepIn
from groundstation.control.state import ControlState

NS_PER_S = 1_000_000_000
STATE_S, NODE_S, CONTROLLER_S, OTHER_S = 0.3, 0.5, 0.5, 1.0
"""After so long without news, state, valve node, controller or another vehicle are silent."""
REST_SPEED_M_S, REST_RATE_RAD_S = 0.012, math.radians(3.0)
"""Slower than this counts as at rest: the estimate's own noise, and what dry friction takes at once."""


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
        neighbours: Names of vehicles whose states its controller wants.
        seen_leader: The one of them that the side camera tells of instead; empty where there is none.
        leader_seen_ns: When it was last seen; None before the first time.
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
        recorder_trouble: What the recorder has lost, or why it writes nothing; empty where all is well.
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
    neighbours: tuple[str, ...] = ()
    seen_leader: str = ""
    leader_seen_ns: int | None = None
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
    recorder_trouble: str = ""
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

    def is_controller_silent(self, now_ns: int) -> bool:
        """Whether the controller demands nothing although there is a state to control."""
        if self.placed_ns is None or self.is_state_silent(now_ns):
            return False
        last_ns = self.placed_ns if self.demand_ns is None else max(self.demand_ns, self.placed_ns)
        return self.is_silent(last_ns, CONTROLLER_S, now_ns)

    def is_node_silent(self, now_ns: int) -> bool:
        """Whether the valve node is silent."""
        return self.is_silent(None if self.node is None else self.node.arrival_ns, NODE_S, now_ns)

    def others_here(self, now_ns: int) -> dict[str, ControlState]:
        """States of the other vehicles that are not too old to brake for."""
        horizon_ns = now_ns - round(OTHER_S * NS_PER_S)
        return {name: seen.state for name, seen in self.others.items() if seen.arrival_ns >= horizon_ns}
