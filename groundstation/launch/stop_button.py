"""The stop of the station: presses in a session of their own, repeated until every vehicle has stopped."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from groundstation.bus.listener import Listener
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.launch.asking import fresh_number, publish, session_with
from groundstation.launch.urgency import going_first
from groundstation.parts.supervision.messages import StopPress, Supervision
from groundstation.supervision.modes import Mode

REPEAT_S = 0.05
"""A press is repeated so often until it is acknowledged: who receives it may just be started again."""
EVERY = ""
"""Vehicle of a press that stops all."""


@dataclass(slots=True)
class Press:
    """A press that has been published.

    Attributes:
        message: Repeated as it is: one press.
        until_s: When repeating it ends, on the monotonic clock.
        waiting: Vehicles that have not stopped yet.
        stopped: Rulings that acknowledged it, by vehicle.
    """

    message: StopPress
    until_s: float
    waiting: set[str]
    stopped: dict[str, Supervision] = field(default_factory=dict)

    @property
    def is_pending(self) -> bool:
        """Whether it is to be repeated."""
        return bool(self.waiting) and time.monotonic() < self.until_s


class StopButton:
    """Presses the stop; one thread. Call ``follow`` while ``is_pending``.

    Args:
        bus: A session of its own.
        vehicles: Names of all vehicles of the run.
        author: Who presses.
    """

    def __init__(self, bus: ZenohBus, vehicles: tuple[str, ...], author: str) -> None:
        self._bus = bus
        self._vehicles = vehicles
        self._author = author
        self._rulings = Listener(bus, (Supervision,))
        self._last_id = 0
        self._presses: list[Press] = []

    @property
    def is_pending(self) -> bool:
        """Whether a press waits for a vehicle that has not stopped."""
        return bool(self._presses)

    def press(self, vehicle: str = EVERY, timeout_s: float = 3.0) -> Press:
        """A fresh press, for one vehicle or for all; published at once.

        Raises:
            zenoh.ZError: The hub is gone.
        """
        self._last_id = max(fresh_number(), self._last_id + 1)
        now_s = time.monotonic()
        message = StopPress(time.monotonic_ns(), vehicle, self._last_id, self._author)
        addressed = {vehicle} if vehicle else set(self._vehicles)
        press = Press(message, now_s + timeout_s, addressed)
        self._presses.append(press)
        publish(self._bus, message)
        return press

    def follow(self, timeout_s: float = REPEAT_S) -> None:
        """Take what vehicles report, for a while at most; then repeat what is not acknowledged.

        Args:
            timeout_s: 0 takes what has come and waits for nothing: in an event loop.

        Raises:
            zenoh.ZError: The hub is gone.
        """
        until_s = time.monotonic() + timeout_s
        while self._presses and ((left_s := until_s - time.monotonic()) > 0 or self._rulings.has_some):
            delivered = self._rulings.take(max(left_s, 0.0))
            if delivered is not None and isinstance(delivered.payload, Supervision):
                self._acknowledge(delivered.payload)
        self._presses = [press for press in self._presses if press.is_pending]
        for press in self._presses:
            publish(self._bus, press.message)

    def _acknowledge(self, ruling: Supervision) -> None:
        if not ruling.stop_latched or ruling.mode == Mode.FLYING:
            return
        for press in self._presses:
            if ruling.vehicle in press.waiting and ruling.stamp_ns >= press.message.stamp_ns:
                press.waiting.remove(ruling.vehicle)
                press.stopped[ruling.vehicle] = ruling
        self._presses = [press for press in self._presses if press.waiting]


@contextmanager
def stop_button(endpoint: str, vehicles: tuple[str, ...], author: str) -> Iterator[StopButton]:
    """A button with a session of its own.

    Raises:
        GroundStationError: The hub is not there, or goes away.
    """
    with going_first(), session_with(endpoint) as bus:
        yield StopButton(bus, vehicles, author)


def press_stop(
    endpoint: str, vehicles: tuple[str, ...], vehicle: str, author: str, timeout_s: float
) -> Press:
    """Press the stop of a run once, and repeat it until it is acknowledged or the time is over.

    Args:
        endpoint: Of the hub.
        vehicles: Names of all vehicles of the run.
        vehicle: Whom to stop; empty for all.
        author: Who presses.
        timeout_s: How long to wait.

    Raises:
        GroundStationError: The hub is not there, or goes away.
    """
    with stop_button(endpoint, vehicles, author) as button:
        press = button.press(vehicle, timeout_s)
        while button.is_pending:
            button.follow()
        return press
