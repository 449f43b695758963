"""What a console shows: a flight that goes on, or a recording. The pages do not tell the two apart."""

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

from groundstation.console.chart_tap import Samples
from groundstation.console.events import Events
from groundstation.console.feed import Feed


class Source(Protocol):
    """Fills a feed.

    Attributes:
        feed: What is known.
        events: What happened.
        vehicles: Names.
        page: What screens are told of the rig, once.
    """

    feed: Feed
    events: Events
    vehicles: tuple[str, ...]
    page: dict[str, Any]

    def step(self) -> int:
        """Take what has come since the last step; the present moment, ns on the clock of its stamps."""

    def extra(self) -> dict[str, Any]:
        """Further keys of the state that screens are sent."""

    def control(self, asked: Mapping[str, Any]) -> None:
        """Move in time, where that can be.

        Raises:
            ValueError: It cannot.
        """

    def columns(self, names: Iterable[str]) -> dict[str, Samples] | None:
        """Fields over the whole of what is known; None where they come as they are published."""

    def close(self) -> None:
        """End it."""
