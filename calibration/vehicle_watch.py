"""What a guided calibration has to know of the vehicle besides its data: whether it may begin, wait or go on.

A vehicle that a person takes while a calibration drives it is that person's: the calibration ends.
"""

from __future__ import annotations

from groundstation.declarations.message import Message
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveStatus
from groundstation.supervision.mode_machine import Then
from groundstation.supervision.modes import Mode


class VehicleWatch:
    """Follows one vehicle.

    Args:
        vehicle: Its name.
    """

    kinds = (Supervision, VehicleState, FusionStatus, ValveStatus)

    def __init__(self, vehicle: str) -> None:
        self._vehicle = vehicle
        self._seen: set[type[Message]] = set()
        self._ruling: Supervision | None = None
        self._floats = True
        self._rest_s = 0.0

    def take(self, message: Message) -> None:
        """Take a message of the vehicle."""
        self._seen.add(type(message))
        match message:
            case Supervision():
                self._ruling = message
            case FusionStatus():
                self._rest_s = message.rest_s
            case ValveStatus():
                self._floats = message.floating

    @property
    def mode(self) -> str:
        """Of the supervisor; empty before its first ruling."""
        return "" if self._ruling is None else self._ruling.mode

    @property
    def floats(self) -> bool:
        """Whether the valve node reports that the float air is on; until it reports anything, too."""
        return self._floats

    @property
    def rest_s(self) -> float:
        """Length of the rest without a break that goes on; 0 while the float air is on."""
        return 0.0 if self._floats else self._rest_s

    @property
    def wants_flight(self) -> bool:
        """Whether it flies, or takes off as soon as it may."""
        return self._ruling is not None and (self._ruling.flight_wanted or self._ruling.is_in_flight)

    @property
    def is_on_its_way_down(self) -> bool:
        """Whether a request to fly would come too early."""
        return self.mode in (Mode.LANDING, Mode.LOST)

    def unknown(self) -> str:
        """What keeps a calibration from beginning, a sentence; empty if nothing does."""
        missing = [
            words
            for kind, words in (
                (VehicleState, "state"),
                (ValveStatus, "valve status"),
                (Supervision, "supervision"),
            )
            if kind not in self._seen
        ]
        if missing:
            return f"{self._vehicle} is not known yet: no {', no '.join(missing)} is received."
        return self.stopped()

    def stopped(self) -> str:
        """A sentence about the stop that is latched; empty without one."""
        ruling = self._ruling
        if ruling is None or not ruling.stop_latched:
            return ""
        return f"{self._vehicle} is stopped{self._whose()}: release the stop first."

    def taken(self, *, is_rest: bool) -> str:
        """A sentence about who took the vehicle after it was asked to rest or to fly; empty if nobody did."""
        ruling = self._ruling
        if ruling is None:
            return ""
        if ruling.stop_latched:
            return f"{self._vehicle} was stopped{self._whose()}: the calibration ends."
        if is_rest:
            is_taken = ruling.flight_wanted or ruling.mode not in (Mode.LANDED, Mode.LANDING, Mode.LOST)
        else:
            is_held = ruling.mode in (Mode.BRAKING, Mode.HOLDING) and ruling.then >= Then.HOLD
            is_taken = not ruling.flight_wanted or (is_held and bool(ruling.author))
        if not is_taken:
            return ""
        return f"{self._vehicle} is {ruling.mode}{self._whose()} ({ruling.cause}): the calibration ends."

    def waits(self) -> str:
        """Why it does not fly yet, in words; empty when it flies."""
        ruling = self._ruling
        if ruling is None:
            return "waits for its supervisor"
        if ruling.mode == Mode.FLYING:
            return ""
        return f"waits until it flies: {ruling.mode} ({'; '.join(ruling.waits_for) or ruling.cause})"

    def _whose(self) -> str:
        return "" if self._ruling is None or not self._ruling.author else f" by {self._ruling.author}"
