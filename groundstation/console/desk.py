"""What people ask for at the console: requests and their answers, notes, the stop."""

import asyncio
import time
from collections.abc import Mapping

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.zenoh_bus import ZenohBus, key_of
from groundstation.console.tokens import Tokens
from groundstation.declarations.request import (
    Ack,
    Action,
    Argument,
    ArgumentError,
    Request,
    checked_name,
)
from groundstation.launch.asking import publish, requests_of, silence
from groundstation.launch.stop_button import EVERY, REPEAT_S, StopButton
from groundstation.parts.scenario.messages import Marker

ANSWER_S = 3.0
SAME_TAP_S, LONGEST_TAP = 10.0, 100
"""A tap arrives by its second way within so long; later the same words are another press."""
RIG = ""
"""Whom requests concern that are the rig's: of the lease, of a scenario."""


class NotAllowedError(Exception):
    """Somebody may not ask for this; the sentence says what would change that."""


class Desk:
    """Publishes requests and waits for their answers; one event loop.

    Args:
        bus: Session with the hub.
        stop_bus: Another one, for the stop alone.
        vehicles: Names of all vehicles.
        actions: The table of actions.
        tokens: Of who holds control.
    """

    def __init__(
        self,
        bus: ZenohBus,
        stop_bus: ZenohBus,
        vehicles: tuple[str, ...],
        actions: Mapping[str, Action],
        tokens: Tokens,
    ) -> None:
        self._bus = bus
        self._vehicles = vehicles
        self._actions = actions
        self.tokens = tokens
        self._waiting: dict[tuple[int, str, str], asyncio.Future[Ack]] = {}
        self._loop = asyncio.get_running_loop()
        self._button = StopButton(stop_bus, vehicles, "console")
        self._following: asyncio.Task[None] | None = None
        self._taps: dict[str, tuple[float, asyncio.Task[dict[str, object]]]] = {}
        bus.subscribe(key_of(Ack.TOPIC, "*"), self._receive)

    async def request(
        self, vehicle: str, action: str, arguments: Mapping[str, object], author: str
    ) -> tuple[bool, str]:
        """Ask something of a vehicle; whether it was accepted, and why not.

        Raises:
            ArgumentError: The arguments are not those of the action.
            NotAllowedError: There is no such action or vehicle, or a vehicle's action names none.
        """
        row = self._actions.get(action)
        if row is None:
            raise NotAllowedError(f"there is no action {action!r:.40} (there are {', '.join(self._actions)})")
        vehicles = ", ".join(self._vehicles)
        if vehicle not in (*self._vehicles, RIG):
            raise NotAllowedError(f"there is no vehicle {vehicle!r:.40} (there are {vehicles})")
        if vehicle == RIG and not row.is_of_rig:
            raise NotAllowedError(f"{action} needs a vehicle: one of {vehicles}")
        given = row.check(arguments)
        whom = RIG if row.is_of_rig else vehicle
        request = requests_of((whom,), action, given, checked_name(author))[0]
        return await self._answered(request)

    def press(self, vehicle: str, tap: str = "") -> "asyncio.Task[dict[str, object]]":
        """Press the stop, now; what became of it is the task's result.

        Args:
            vehicle: Whom to stop; empty for all.
            tap: Of a screen that sends the same tap by two ways: it is one press. Empty: each call is one.
        """
        now_s = time.monotonic()
        self._taps = {key: row for key, row in self._taps.items() if now_s - row[0] < SAME_TAP_S}
        tap = tap[:LONGEST_TAP]
        if tap in self._taps:
            return self._taps[tap][1]
        press = self._button.press(vehicle or EVERY, ANSWER_S)
        if self._following is None or self._following.done():
            self._following = asyncio.create_task(self._follow())
        following = self._following

        async def result() -> dict[str, object]:
            await asyncio.shield(following)
            return {
                "accepted": not press.waiting,
                "stopped": {name: ruling.mode for name, ruling in press.stopped.items()},
                "not_confirmed": sorted(press.waiting),
            }

        task = asyncio.create_task(result())
        if tap:
            self._taps[tap] = now_s, task
        return task

    def mark(self, text: str) -> None:
        """Publish a marker: a note at this moment, for the recording.

        Raises:
            ArgumentError: It is no line of words.
        """
        publish(self._bus, Marker(time.monotonic_ns(), RIG, checked_line(text)))

    async def _follow(self) -> None:
        while self._button.is_pending:
            self._button.follow(0.0)
            await asyncio.sleep(REPEAT_S)

    async def _answered(self, request: Request) -> tuple[bool, str]:
        key = (request.request_id, request.author, request.vehicle)
        answer: asyncio.Future[Ack] = self._loop.create_future()
        self._waiting[key] = answer
        publish(self._bus, request)
        try:
            ack = await asyncio.wait_for(answer, ANSWER_S)
        except TimeoutError:
            return False, silence(request.vehicle, ANSWER_S)
        finally:
            del self._waiting[key]
        return ack.accepted, ack.reason

    def _receive(self, key: str, payload: bytes, attachment: bytes) -> None:
        """On Zenoh's thread."""
        del key, attachment
        self._loop.call_soon_threadsafe(self._settle, payload)

    def _settle(self, payload: bytes) -> None:
        try:
            ack = codec_of(Ack).decode(payload)
        except CodecError:
            return  # of somebody else
        waiting = self._waiting.get((ack.request_id, ack.author, ack.vehicle))
        if waiting is not None and not waiting.done():
            waiting.set_result(ack)


def checked_line(text: str) -> str:
    """A note.

    Raises:
        ArgumentError: It is empty, too long, or no line of letters.
    """
    note = Argument("text", kind=str).read(text.strip(), "mark")
    if not note:
        raise ArgumentError("mark: text is empty, expected a note")
    return str(note)
