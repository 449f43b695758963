"""Controller: vehicle state in, wrench out, at the rate of the pulse modulation."""

import math
from collections.abc import Iterator
from dataclasses import replace

from groundstation.control.averaging import RateMean
from groundstation.control.controller import Controller, KeepsPlaces
from groundstation.control.keep_in import KeepIn
from groundstation.control.leading import lost_followers
from groundstation.control.state import NO_WRENCH, BodyWrench, ControlState, Goal, Vector2
from groundstation.control.surroundings import Obstacle
from groundstation.declarations.lease import Lease, LeaseCheck
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Ack, ArgumentError, Request, answer
from groundstation.frames import wrap_angle
from groundstation.fusion.slope_grid import SlopeGrid
from groundstation.parts.control.actions import CHANGE_CONTROLLER, GO_TO
from groundstation.parts.control.laws import HOLDING, Law, Maker, parameters_of
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.fusion.messages import FusionStatus, VehicleState, control_state
from groundstation.parts.relative_navigation.messages import LeaderState, leader_control_state
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveCommand, ValveDemand
from groundstation.supervision.apart import Others
from groundstation.supervision.modes import GROUNDED, Mode

STALE_NS = 300_000_000
RESUME = "resume"
STATUS_EVERY = 2
DOWN = frozenset((*GROUNDED, Mode.LANDING))
"""Modes of a mock-up that has fallen out of a formation: its supervisor has cut its air."""


class ControllerNode(Node):
    """Runs the control law of the rig; silent while the state is stale or the vehicle is not flying.

    Args:
        vehicle: Its name.
        law: Of the rig: its neighbours' states come at their full rate.
        goal: Held from the start.
        keep_in: Goals outside are refused.
        others: All other vehicles: it is not sent to where one of them is, or is sent.
        period_s: Of the modulation.
        table_map: What pulls where on the table, fed forward; None where nobody knows.
        make: Makes the laws that it is changed to; None where it keeps its own.
        obstacles: What stands on the table: goals in it are refused.
        waits: The program begins with the request ``resume``.
        sees: The neighbour that laws know by what the own side camera sees of it, instead of by the other's
            own estimate; empty for none.
    """

    inputs: tuple[type[Message], ...] = (
        VehicleState,
        ControlStatus,
        FusionStatus,
        ValveDemand,
        ValveCommand,
        Supervision,
        Request,
        Lease,
    )
    outputs = (Wrench, ControlStatus, Ack)
    trigger = VehicleState

    def __init__(
        self,
        vehicle: str,
        law: Law,
        goal: Goal,
        keep_in: KeepIn,
        others: tuple[str, ...],
        period_s: float,
        table_map: SlopeGrid | None = None,
        make: Maker | None = None,
        *,
        obstacles: tuple[Obstacle, ...] = (),
        waits: bool = False,
        sees: str = "",
    ) -> None:
        super().__init__(vehicle, round(period_s * 1e9))
        self._sees = sees
        if sees:
            self.inputs = (*self.inputs, LeaderState)
        self._chosen = law
        self._law = law.to_goal if waits else law.controller
        self._make = make
        self._goal = goal
        self._keep_in = keep_in
        self._at_full_rate = frozenset((vehicle, *law.neighbours))
        self._followed = self._at_full_rate
        self._vehicles = (vehicle, *others)
        self._led_by: dict[str, tuple[str, ...]] = {}
        self._others = Others(obstacles=obstacles)
        self._lease = LeaseCheck()
        self._states: dict[str, tuple[int, ControlState]] = {}
        self._down: set[str] = set()
        self._own_rate = RateMean()
        self._map = table_map
        self._slope_left_m_s2 = (0.0, 0.0)
        self._gate_open = False
        self._delivered = NO_WRENCH
        self._ticks = 0

    def sources(self, payload: type[Message]) -> tuple[str, ...]:
        if payload is VehicleState:
            return self._vehicles
        if payload is Supervision:
            cares = isinstance(self._chosen.controller, KeepsPlaces)
            return tuple(name for name in self._vehicles[1:] if cares and name in self._followed)
        return self._vehicles[1:] if payload is ControlStatus else (self.vehicle,)

    def takes_paced(self, payload: type[Message], source: str) -> bool:
        return payload is VehicleState and source not in self._at_full_rate

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        match message:
            case VehicleState():
                self._receive_state(message)
            case LeaderState():
                if message.seen == self._sees and message.seen in self._followed:
                    self._states[message.seen] = (message.stamp_ns, leader_control_state(message))
            case ControlStatus():
                self._others.goals_table_m[message.vehicle] = message.goal_position_table_m
                self._led_by[message.vehicle] = message.led_by
                self._break_circle()
            case Supervision():
                (self._down.add if message.mode in DOWN else self._down.discard)(message.vehicle)
            case FusionStatus():
                self._slope_left_m_s2 = message.slope_left_m_s2
            case ValveDemand():
                self._delivered = BodyWrench(message.delivered_force_body_n, message.delivered_torque_nm)
            case ValveCommand():
                is_open = message.gate == "open"
                if is_open and not self._gate_open:
                    self._law.reset()
                self._gate_open = is_open
            case Request() if message.action == GO_TO.name:
                refusal = self._lease.objection(message, now_ns)
                yield answer(message, now_ns, refusal or self._go_to(message))
            case Request() if message.action == CHANGE_CONTROLLER.name:
                refusal = self._lease.objection(message, now_ns)
                yield answer(message, now_ns, refusal or self._change(message))
            case Request() if message.action == RESUME and not self._lease.objection(message, now_ns):
                self._take_over(self._chosen.controller)  # the supervisor answers
            case Lease():
                self._lease.take(message)

    def tick(self, now_ns: int) -> Iterator[Message]:
        fresh = {
            name: state.carried((now_ns - stamp_ns) * 1e-9)
            for name, (stamp_ns, state) in self._states.items()
            if now_ns - stamp_ns <= STALE_NS
        }
        state = self._own_rate.take()
        if state is None or fresh.pop(self.vehicle, None) is None:
            return
        if isinstance(self._law, KeepsPlaces):
            seen_m = self._others.positions_table_m
            self._law.see_fallen({name: seen_m[name] for name in self._down if name in seen_m})
        wrench = self._law.update(
            self._with_slope(state),
            self._goal,
            self.tick_period_ns * 1e-9,
            applied=self._delivered if self._gate_open else NO_WRENCH,
            neighbours=fresh,
        )
        fx, fy = wrench.force_body_n
        yield Wrench(now_ns, self.vehicle, fx, fy, 0.0, 0.0, 0.0, wrench.torque_nm)
        self._ticks += 1
        if self._ticks % STATUS_EVERY == 0:
            yield self._status(state, now_ns)

    def _receive_state(self, message: VehicleState) -> None:
        if message.vehicle != self.vehicle:
            self._others.positions_table_m[message.vehicle] = message.position_table_m
        if message.status != "flying" or message.vehicle not in self._followed:
            return
        if message.vehicle == self._sees:
            return  # where it is comes from the side camera
        state = control_state(message)
        self._states[message.vehicle] = (message.stamp_ns, state)
        if message.vehicle == self.vehicle:
            self._own_rate.add(state)

    def _with_slope(self, state: ControlState) -> ControlState:
        """Add what is known to pull here: the map, and what the filter finds beyond it."""
        if self._map is None:
            return state
        known, left = self._map.at(*state.position_table_m), self._slope_left_m_s2
        return replace(state, slope_table_m_s2=(known[0] + left[0], known[1] + left[1]))

    def _go_to(self, request: Request) -> str:
        """Take the goal, or say why not."""
        try:
            given = GO_TO.read(request)
        except ArgumentError as error:
            return str(error)
        x, y, heading = (float(given[name]) for name in ("x_m", "y_m", "heading_rad"))
        if not self._is_kept_to((x, y)):
            return f"({x:.3f}, {y:.3f}) m lies outside the part of the table that vehicles keep to"
        refusal = self._others.objection((x, y))
        if not refusal:
            self._goal = Goal((x, y), heading)
            self._take_over(self._chosen.to_goal)
        return refusal

    def _change(self, request: Request) -> str:
        """Fly by another law from where the present one works for, or say why not."""
        try:
            given = CHANGE_CONTROLLER.read(request)
            if self._make is None:
                return "its law was given to it by a program, and stays"
            law = self._make(str(given["controller"]), parameters_of(str(given["parameters"])))
        except ValueError as error:  # an ArgumentError is one
            return str(error)
        if self._is_lost(law):
            return f"{', '.join(law.led_by)} would be led by {self.vehicle} itself: nobody would lead"
        self._change_to(law)
        return ""

    def _is_lost(self, law: Law) -> bool:
        """Whether nobody would lead this vehicle, over however many others, if it flew by a law."""
        led_by = {name: self._led_by.get(name, ()) for name in self._vehicles}
        return self.vehicle in lost_followers({**led_by, self.vehicle: law.led_by})

    def _break_circle(self) -> None:
        """Hold where it is if two changes at the same moment have made some follow each other."""
        if self._make is not None and self._chosen.led_by and self._is_lost(self._chosen):
            self._change_to(self._make(HOLDING, {}))

    def _change_to(self, law: Law) -> None:
        setpoint, own = self._law.setpoint(self._goal), self._states.get(self.vehicle)
        if self._is_kept_to(setpoint.position_table_m):
            self._goal = setpoint
        elif own is not None and self._is_kept_to(own[1].position_table_m):
            self._goal = Goal(own[1].position_table_m, own[1].heading_rad)
        self._chosen = law
        self._followed = frozenset((self.vehicle, *law.neighbours))
        self._states = {name: row for name, row in self._states.items() if name in self._followed}
        self._take_over(law.to_goal)

    def _is_kept_to(self, place_m: Vector2) -> bool:
        return min(self._keep_in.edge_distances_m(place_m)) >= 0.0

    def _take_over(self, law: Controller) -> None:
        if law is not self._law:
            law.reset()
            self._law = law

    def _status(self, state: ControlState, now_ns: int) -> ControlStatus:
        setpoint = self._law.setpoint(self._goal)
        distance_m = math.dist(state.position_table_m, setpoint.position_table_m)
        turn_rad = wrap_angle(setpoint.heading_rad - state.heading_rad)
        return ControlStatus(
            now_ns,
            self.vehicle,
            self._chosen.name,
            setpoint.position_table_m,
            setpoint.heading_rad,
            distance_m,
            turn_rad,
            self._chosen.neighbours,
            self._chosen.led_by,
        )
