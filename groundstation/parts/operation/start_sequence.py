"""Start sequence: landed, rest calibration, float air, armed, flying; the operator who presses start.

It asks by requests like everybody else, repeats what was not answered by deeds, and keeps its hands off
a vehicle that somebody stopped or disarmed.
"""

from collections.abc import Iterator

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.declarations.request import Request
from groundstation.parts.fusion.messages import FusionStatus
from groundstation.parts.operation.messages import SequencePhase
from groundstation.parts.valves.messages import ValveStatus, VehicleMode

PERIOD_NS = 100_000_000
PATIENCE_NS = 1_000_000_000
GUARD_STARTED = ""  # author of the mode that a guard states when it starts


class StartSequence(Node):
    """Takes one vehicle from landed to flying."""

    inputs = (FusionStatus, ValveStatus, VehicleMode)
    outputs = (Request, SequencePhase)

    def __init__(self, vehicle: str, rest_s: float) -> None:
        super().__init__(vehicle, PERIOD_NS)
        self._rest_s = rest_s
        self._fusion: FusionStatus | None = None
        self._valves: ValveStatus | None = None
        self._mode: VehicleMode | None = None
        self._phase = ""
        self._request_id = 0
        self._asked_ns = 0
        self._asked = ""

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        match message:
            case FusionStatus():
                self._fusion = message
            case ValveStatus():
                self._valves = message
            case VehicleMode():
                self._mode = message
        yield from ()

    def tick(self, now_ns: int) -> Iterator[Message]:
        phase, detail, action = self._next()
        if phase != self._phase:
            self._phase = phase
            yield SequencePhase(now_ns, self.vehicle, phase, detail)
        if action and (action != self._asked or now_ns - self._asked_ns >= PATIENCE_NS):
            self._asked, self._asked_ns = action, now_ns
            self._request_id += 1
            yield Request(now_ns, self.vehicle, self._request_id, "start_sequence", action, "")

    def _next(self) -> tuple[str, str, str]:
        """Phase, detail for people, and what to ask for."""
        fusion, valves, mode = self._fusion, self._valves, self._mode
        if mode is None or valves is None or fusion is None:
            missing = [
                name
                for name, value in (("guard", mode), ("valve node", valves), ("fusion", fusion))
                if value is None
            ]
            return "waiting", f"nothing received yet from {', '.join(missing)}", ""
        if mode.stopped:
            return "stopped", f"by {mode.source}", ""
        if not valves.floating:
            if self._phase == "flying":
                return "landed by somebody", "float air is off", ""
            if self._phase == "landed by somebody":
                return self._phase, "", ""
            if fusion.rest_s < self._rest_s:
                return "rest calibration", f"resting for {self._rest_s:g} s", ""
            if fusion.status != "flying":
                return "waiting for a pose", "no star fix has placed it yet", ""
            return "float air", "", "float_on"
        if not mode.armed:
            if mode.source not in (GUARD_STARTED, "start_sequence"):
                return "disarmed", f"by {mode.source}", ""
            return "arming", "", "arm"
        if not valves.armed:  # the node missed the order, or started anew
            return "arming", "the valve node is not armed", "arm"
        return "flying", "", ""
