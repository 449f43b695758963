"""What people ask for at the console: requests and their answers, the lease, the stop."""

import asyncio
import hashlib
import hmac
import secrets
import time
from collections.abc import Callable, Mapping

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.zenoh_bus import ZenohBus, key_of
from groundstation.declarations.lease import FREE_FOR_ALL
from groundstation.declarations.request import (
    Ack,
    Action,
    Argument,
    ArgumentError,
    Request,
    Value,
    checked_name,
)
from groundstation.launch.asking import publish, requests_of, silence
from groundstation.launch.stop_button import EVERY, REPEAT_S, StopButton
from groundstation.parts.scenario.messages import Marker

ANSWER_S, LOOK_S = 3.0, 0.02
SAME_TAP_S, LONGEST_TAP = 10.0, 100
"""A tap arrives by its second way within so long; later the same words are another press."""
RIG = ""
"""Whom requests concern that are the rig's: the lease."""
Ask = Callable[[str, str, Mapping[str, Value], str], "asyncio.Future[Ack]"]


class NotAllowedError(Exception):
    """Somebody may not ask for this; the sentence says what would change that."""


class Tokens:
    """Who holds control shows it by a token, which no console has to remember: another one accepts it, too.

    Args:
        secret: Of this run.
    """

    def __init__(self, secret: bytes) -> None:
        self._secret = secret

    def of(self, name: str) -> str:
        """The token of a name."""
        mark = hmac.new(self._secret, name.encode(), hashlib.sha256).hexdigest()
        return f"{name.encode().hex()}.{mark}"

    def name(self, token: str) -> str:
        """The name of a token; empty for one that is none."""
        try:
            name = bytes.fromhex(token.partition(".")[0]).decode()
        except ValueError:
            return ""
        return name if secrets.compare_digest(token.encode(), self.of(name).encode()) else ""


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
            NotAllowedError: There is no such action or vehicle.
        """
        row = self._actions.get(action)
        if row is None:
            raise NotAllowedError(f"there is no action {action!r:.40} (there are {', '.join(self._actions)})")
        if vehicle not in (*self._vehicles, RIG):
            raise NotAllowedError(
                f"there is no vehicle {vehicle!r:.40} (there are {', '.join(self._vehicles)})"
            )
        given = row.check(arguments)
        request = requests_of((vehicle,), action, given, checked_name(author))[0]
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


class LeaseOffice:
    """Takes, renews, gives up and passes on control in the name of people at screens.

    Args:
        desk: To ask at.
        holder: Who holds control now; empty for nobody.
    """

    def __init__(self, desk: Desk, holder: Callable[[], str]) -> None:
        self._desk = desk
        self._holder = holder
        self._passed_to: tuple[str, float] | None = None

    async def take(self, name: str, token: str, for_s: float, force: str) -> str:
        """Take control, or keep it; the token that shows it.

        Raises:
            NotAllowedError: Somebody else has it, or somebody of this name at another screen.
        """
        holder = self._holder()
        if name and holder == name and self._desk.tokens.name(token) != name and not self._was_passed(name):
            raise NotAllowedError(
                f"control is held by somebody of the name {name!r} at another screen: choose another name"
            )
        arguments: dict[str, object] = {"for_s": for_s}
        if force:
            arguments["force"] = force
        accepted, reason = await self._desk.request(RIG, "take_control", arguments, name)
        if not accepted:
            raise NotAllowedError(reason)
        await self._until_held_by(name)
        return self._desk.tokens.of(name)

    def holder_of(self, token: str) -> str:
        """Whose token it is; empty for one that is none."""
        return self._desk.tokens.name(token)

    async def give(self, token: str, to: str = "") -> None:
        """Give control up, or pass it on.

        Raises:
            NotAllowedError: It is not held by whom the token shows.
        """
        name = self._desk.tokens.name(token)
        if not name:
            raise NotAllowedError("this token shows nobody's control: take control first")
        accepted, reason = await self._desk.request(RIG, "give_control", {"to": to}, name)
        if not accepted:
            raise NotAllowedError(reason)
        self._passed_to = (to, time.monotonic()) if to else None
        await self._until_held_by(to)

    def author(self, action: str, token: str) -> str:
        """In whose name an action is asked for.

        Raises:
            NotAllowedError: The action needs control, and the token does not show it.
        """
        name = self._desk.tokens.name(token)
        if action in FREE_FOR_ALL:
            return name or "console"
        if not name:
            raise NotAllowedError("take control first: only who holds it may ask for this")
        holder = self._holder()
        if holder != name:
            raise NotAllowedError(f"control is held by {holder or 'nobody'}: take it first")
        return name

    async def _until_held_by(self, name: str) -> None:
        """Wait until the lease says so here, too: an answer comes sooner than what it changed."""
        until_s = time.monotonic() + ANSWER_S
        while self._holder() != name and time.monotonic() < until_s:
            await asyncio.sleep(LOOK_S)

    def _was_passed(self, name: str) -> bool:
        """Whether control was passed on to this name from here, and nobody has shown up for it yet."""
        passed = self._passed_to
        if passed is None or passed[0] != name:
            return False
        self._passed_to = None
        return True


def checked_line(text: str) -> str:
    """A note.

    Raises:
        ArgumentError: It is empty, too long, or no line of letters.
    """
    note = Argument("text", kind=str).read(text.strip(), "mark")
    if not note:
        raise ArgumentError("mark: text is empty, expected a note")
    return str(note)
