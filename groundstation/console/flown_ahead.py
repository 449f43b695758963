"""Before a request is made at the console it is flown in virtual time, and its path is shown."""

import asyncio
import json
import pickle
import sys
from typing import Any

from groundstation.console.dry_flight import Question
from groundstation.console.feed import Feed
from groundstation.declarations.request import ArgumentError
from groundstation.declarations.rig import Rig
from groundstation.launch.orders import Orders
from groundstation.parts.fusion.messages import VehicleState

ACTION = "go_to"
"""What can be flown ahead."""
LONGEST_S = 180.0


class FlownAhead:
    """Flies requests on the rig's emulated twin.

    Args:
        rig: Of the flight.
        feed: Where the vehicles are.
        orders: With the rig's text and files.
    """

    def __init__(self, rig: Rig, feed: Feed, orders: Orders) -> None:
        self._rig = rig
        self._feed = feed
        self._orders = orders
        self._flying: asyncio.subprocess.Process | None = None

    @property
    def can_fly(self) -> bool:
        """Whether the rig has a laboratory that runs in virtual time."""
        return self._rig.laboratory is not None

    async def fly(self, vehicle: str, action: str, arguments: dict[str, object]) -> dict[str, Any]:
        """Fly a request from where the vehicles are now; a newer question ends an older one.

        Raises:
            ArgumentError: It cannot be flown ahead, or its arguments are not those of the action.
        """
        if vehicle not in self._rig.vehicles or action != ACTION:
            raise ArgumentError(f"only {ACTION} of one of {', '.join(self._rig.vehicles)} is flown ahead")
        given = self._rig.tables.actions[action].check(arguments)
        poses = {}
        for name in self._rig.vehicles:
            state = self._feed.get(VehicleState, name)
            if state is None:
                raise ArgumentError(f"nothing was received of {name} yet: where it is, is not known")
            poses[name] = (*state.position_table_m, state.heading_rad)
        numbers = {name: float(value) for name, value in given.items()}
        question = Question(
            self._orders.rig_text, self._orders.rig_path, self._orders.files, poses, vehicle, action, numbers
        )
        return await self._answer(question)

    async def _answer(self, question: Question) -> dict[str, Any]:
        if self._flying is not None and self._flying.returncode is None:
            self._flying.kill()
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "groundstation.console.dry_flight",
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
        )
        self._flying = process
        try:
            written, complaints = await asyncio.wait_for(
                process.communicate(pickle.dumps(question)), LONGEST_S
            )
        except TimeoutError:
            process.kill()
            return {"refused": f"the dry flight took longer than {LONGEST_S:g} s", "paths": {}}
        if process.returncode:
            last = complaints.decode(errors="replace").strip().rpartition("\n")[2]
            reason = last or "it was replaced by a newer one"
            return {"refused": f"the dry flight failed: {reason}", "paths": {}}
        found: dict[str, Any] = json.loads(written)
        return found
