"""The limits of the scenario that flies, as they are decided."""

from dataclasses import asdict
from typing import Any

from groundstation.console.feed import Feed
from groundstation.declarations.message import Message
from groundstation.scenario.flight_log import LOGGED, FlightLog
from groundstation.scenario.loading import Scenario
from groundstation.scenario.standing import standings

LOOK_NS = 2_000_000_000


class LimitWatch:
    """Gathers what the limits of a scenario are made from.

    Args:
        scenario: That flies.
        feed: Of its messages.
    """

    def __init__(self, scenario: Scenario, feed: Feed) -> None:
        self._scenario = scenario
        self._log = FlightLog(tuple(scenario.rig.vehicles))
        self._due_ns = 0
        self._shown: list[dict[str, Any]] = []
        for kind in LOGGED:
            feed.on(kind, self._take)

    def shown(self, now_ns: int) -> list[dict[str, Any]]:
        """Each limit with its value so far, and whether it was held; computed anew every two seconds."""
        if now_ns >= self._due_ns:
            self._due_ns = now_ns + LOOK_NS
            self._shown = [asdict(standing) for standing in standings(self._scenario, self._log)]
        return self._shown

    def _take(self, message: Message, owner: str) -> None:
        del owner
        self._log.take(message, message.stamp_ns)
