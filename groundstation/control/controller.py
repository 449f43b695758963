"""What every controller is: the one interface that nodes and contract tests know."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Protocol, runtime_checkable

from groundstation.control.state import BodyWrench, ControlState, Goal, Vector2

NO_NEIGHBOURS: Mapping[str, ControlState] = MappingProxyType({})
LONGEST_SPAN_S = 1.0
"""After a longer gap an observer takes the measurement as it is, and a reference goes on from there."""


def span_of(dt_s: float) -> float:
    """The span of an update, as long as it is believed.

    Raises:
        ValueError: It is not positive and finite.
    """
    if not (math.isfinite(dt_s) and dt_s > 0.0):
        raise ValueError(f"dt_s must be above 0, found {dt_s}")
    return min(dt_s, LONGEST_SPAN_S)


class Controller(Protocol):
    """State and goal in, wrench out."""

    def reset(self) -> None:
        """Forget the past: at arming, and whenever another source had the valves for long."""

    def setpoint(self, goal: Goal) -> Goal:
        """What the law works for at present, given the goal: its status reports the distance to it."""

    def update(
        self,
        state: ControlState,
        goal: Goal,
        dt_s: float,
        *,
        applied: BodyWrench | None = None,
        neighbours: Mapping[str, ControlState] = NO_NEIGHBOURS,
    ) -> BodyWrench:
        """The wrench for the coming span.

        Args:
            state: Newest estimate, table frame.
            goal: Where to be.
            dt_s: Time since the last update; the first one may state the nominal period.
            applied: Mean wrench that acted since the last update, where it is known (delivered pulses, zero
                while disarmed); None means the wrench returned last.
            neighbours: States of other mock-ups by name, carried to the present
                (`ControlState.carried`); leave out those that are stale.

        Returns:
            A wrench that the valves can make, body axes.

        Raises:
            ValueError: `dt_s` is not positive and finite.
        """


@runtime_checkable
class KeepsPlaces(Protocol):
    """What a controller has beside that, which cares for ships that come down."""

    def see_fallen(self, places_m: Mapping[str, Vector2]) -> None:
        """Take who of its neighbours is down by its supervisor's ruling, and where it lies.

        Args:
            places_m: All that are down at this moment, by name; table frame. Called before each `update`.
        """
