"""A push by hand: an operator's wrench for a while."""

from groundstation.control.state import BodyWrench
from groundstation.declarations.request import ArgumentError, Request
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.actions import PUSH
from groundstation.supervision.modes import Law


class HandPush:
    """Gives a new demand each period until the push has lasted.

    Args:
        period_ns: Of the modulation.
    """

    def __init__(self, period_ns: int) -> None:
        self._period_ns = period_ns
        self._wrench: BodyWrench | None = None
        self._until_ns: int  # both with the wrench
        self._due_ns: int

    def begin(self, request: Request, ruling: Supervision | None, now_ns: int) -> str:
        """Push from now on; the reason if it cannot be done."""
        try:
            given = PUSH.read(request)
        except ArgumentError as error:
            return str(error)
        if ruling is None or ruling.law != Law.CONTROLLER:
            mode = "waiting for its supervisor" if ruling is None else ruling.mode
            return f"only a flying vehicle can be pushed, it is {mode}"
        force = (float(given["force_x_n"]), float(given["force_y_n"]))
        self._wrench = BodyWrench(force, float(given["torque_nm"]))
        self._until_ns, self._due_ns = now_ns + round(float(given["span_s"]) * 1e9), now_ns
        return ""

    def end(self) -> None:
        """Push no longer."""
        self._wrench = None

    def due(self, now_ns: int) -> tuple[BodyWrench | None, bool]:
        """The wrench of the period that begins now, None where none does; whether the push is over now."""
        if self._wrench is None:
            return None, False
        if now_ns >= self._until_ns:
            self._wrench = None
            return None, True
        if now_ns < self._due_ns:
            return None, False
        self._due_ns += self._period_ns
        return self._wrench, False
