"""Frames that the adapter did not take: tried again for 100 ms, stop first, the newest of each identifier."""

from drivers.valve_bus.frame import CanFrame
from drivers.valve_bus.messages import SILENCE_CLOSES_S

LASTS_NS = round(SILENCE_CLOSES_S * 1e9)
"""An older frame would act on a node that has closed by itself meanwhile."""


class Outbox:
    """What waits to be sent, in the order of the bus: the lowest identifier first, so a stop before all.

    A newer frame of an identifier replaces the one that waits: it holds what remains of a pulse.

    Attributes:
        lost: Frames that were never sent: too old, or replaced.
    """

    def __init__(self) -> None:
        self.lost = 0
        self._waiting: dict[int, tuple[int, CanFrame]] = {}
        self._refused_since_ns: int | None = None

    def __bool__(self) -> bool:
        return bool(self._waiting)

    def put(self, now_ns: int, frame: CanFrame) -> None:
        """Let a frame wait."""
        self.lost += frame.arbitration_id in self._waiting
        self._waiting[frame.arbitration_id] = now_ns, frame

    def first(self, now_ns: int) -> CanFrame | None:
        """What to try now; what has waited for too long is lost."""
        for identifier in sorted(self._waiting):
            since_ns, frame = self._waiting[identifier]
            if now_ns - since_ns < LASTS_NS:
                return frame
            del self._waiting[identifier]
            self.lost += 1
        return None

    def sent(self, frame: CanFrame) -> None:
        """It was taken."""
        self._waiting.pop(frame.arbitration_id, None)
        self._refused_since_ns = None

    def refused(self, now_ns: int) -> None:
        """A frame was not taken."""
        if self._refused_since_ns is None:
            self._refused_since_ns = now_ns

    def is_stuck(self, now_ns: int) -> bool:
        """Whether nothing has been taken for 100 ms."""
        return self._refused_since_ns is not None and now_ns - self._refused_since_ns >= LASTS_NS
