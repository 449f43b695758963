"""Control of the rig in the name of people at screens."""

import asyncio
import time
from collections.abc import Callable

from groundstation.console.desk import ANSWER_S, RIG, Desk, NotAllowedError
from groundstation.declarations.lease import FREE_FOR_ALL

LOOK_S = 0.02


class LeaseOffice:
    """Takes, renews, gives up and passes on control in the name of people at screens.

    Args:
        desk: To ask at.
        holder: Who holds control now; empty for nobody; None while nothing of the lease was received yet.
    """

    def __init__(self, desk: Desk, holder: Callable[[], str | None]) -> None:
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

    async def author(self, action: str, token: str) -> str:
        """In whose name an action is asked for.

        Raises:
            NotAllowedError: The action needs control, and the token does not show it.
        """
        name = self._desk.tokens.name(token)
        if action in FREE_FOR_ALL:
            return name or "console"
        if not name:
            raise NotAllowedError("take control first: only who holds it may ask for this")
        # a console that was started again learns it from the next repetition of the lease
        await self._until(lambda: self._holder() is not None)
        holder = self._holder()
        if holder != name:
            raise NotAllowedError(f"control is held by {holder or 'nobody'}: take it first")
        return name

    async def _until_held_by(self, name: str) -> None:
        """Wait until the lease says so here, too: an answer comes sooner than what it changed."""
        await self._until(lambda: (self._holder() or "") == name)

    async def _until(self, is_so: Callable[[], bool]) -> None:
        until_s = time.monotonic() + ANSWER_S
        while not is_so() and time.monotonic() < until_s:
            await asyncio.sleep(LOOK_S)

    def _was_passed(self, name: str) -> bool:
        """Whether control was passed on to this name from here, and nobody has shown up for it yet."""
        passed = self._passed_to
        if passed is None or passed[0] != name:
            return False
        self._passed_to = None
        return True
