"""One console: what it shows, who may reach it, where its requests go."""

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from groundstation.bus.fields import fields_of
from groundstation.console.access import Access
from groundstation.console.desk import Desk
from groundstation.console.hall import Hall
from groundstation.console.lease_office import LeaseOffice
from groundstation.console.source import Source
from groundstation.console.wizards import Wizards
from groundstation.declarations.lease import Lease
from groundstation.declarations.tables import Tables

Preview = Callable[[str, str, dict[str, object]], Awaitable[dict[str, Any]]]


class Console:
    """Everything that one server serves.

    Args:
        source: What is shown.
        tables: Of the rig.
        access: How it is reached.
        desk: Where requests are made; None where nothing can be asked for: a recording.
        preview: Flies a request in virtual time; None where that cannot be.
    """

    def __init__(
        self,
        source: Source,
        tables: Tables,
        access: Access,
        desk: Desk | None = None,
        preview: Preview | None = None,
    ) -> None:
        self.source = source
        self.tables = tables
        self.access = access
        self.desk = desk
        self.preview = preview
        self.hall = Hall(source, tables.payloads)
        self.office = None if desk is None else LeaseOffice(desk, self.holder)
        self.wizards: Wizards | None = None

    def lead(self, wizards: Wizards) -> None:
        """Let guided calibrations be led here."""
        self.wizards = wizards
        self.hall.greetings.append(wizards.frame)

    def holder(self) -> str | None:
        """Who holds control now; empty for nobody; None while nothing of the lease was received."""
        lease = self.hall.look().get("lease", {})
        if self.source.feed.get(Lease, "") is None:
            return None
        return str(lease.get("holder", "")) if lease.get("left_s", 0.0) > 0.0 else ""

    def topics(self) -> list[dict[str, Any]]:
        """Every topic of the tables that something came of, with its numbers."""
        feed = self.source.feed
        found = []
        for noun, owner in sorted(feed.newest):
            kind = self.tables.payloads.get(noun)
            if kind is not None:
                numbers = [str(field) for field in fields_of(kind, owner)]
                found.append(
                    {
                        "topic": f"{owner or 'rig'}/{noun}",
                        "type": kind.ROS_TYPE,
                        "rate_hz": kind.TOPIC.rate_hz,
                        "count": feed.counts[noun, owner],
                        "fields": numbers,
                    }
                )
        return found

    def press(self, desk: Desk, asked: Mapping[str, object]) -> "asyncio.Task[dict[str, object]]":
        """Press the stop of a vehicle, or of all where none of this run is named: a stop is never refused."""
        vehicle = str(asked.get("vehicle") or "")
        return desk.press(vehicle if vehicle in self.source.vehicles else "", str(asked.get("tap") or ""))
