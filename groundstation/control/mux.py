"""Who may command: brake > operator > outside > controller, each only while it is fresh.

Ages are judged by arrival stamps against the stamp of the question, never by stamps inside messages. Silence
of the controller brakes, for closed valves on a frictionless table mean coasting; braking needs a state,
carried on by the model for a while where none comes, so without one all valves close. Who commands from
outside has the vehicle until a person gives it back: his silence brakes, too, and the controller waits.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

from pydantic import ConfigDict, Field

from groundstation.files.plain_model import PlainModel

Demand = TypeVar("Demand")
NS_PER_S = 1_000_000_000


class Source(StrEnum):
    """Whose demand goes to the valves."""

    BRAKE = "brake"
    OPERATOR = "operator"
    OUTSIDE = "outside"
    CONTROLLER = "controller"
    CLOSED = "closed"


class MuxConfig(PlainModel):
    """How long each input stays fresh; from its rate: about three periods.

    Attributes:
        operator_s: The operator's demands.
        outside_s: Those of a program outside the station.
        controller_s: The controller's; with the bus and the valves braking pushes within 0.3 s.
        state_s: A state to brake on; longer than a controller may fly by, for the brake law carries it on.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    operator_s: float = Field(default=0.3, gt=0.0)
    outside_s: float = Field(default=0.24, gt=0.0)
    controller_s: float = Field(default=0.24, gt=0.0)
    state_s: float = Field(default=2.0, gt=0.0)


@dataclass(frozen=True, slots=True)
class Selection(Generic[Demand]):
    """The answer: for operator and controller their demand, else None.

    Attributes:
        source: CLOSED: close all valves; BRAKE: use the brake law.
        demand: What the source asked for.
        is_new: The demand was not selected before; an old one is only refreshed, not started again.
        reason: Why this source, in words for the log and the console.
    """

    source: Source
    demand: Demand | None
    is_new: bool
    reason: str


class CommandMux(Generic[Demand]):
    """Chooses among the sources; all times are nanoseconds of one clock, given by the caller.

    Args:
        config: How long each input stays fresh.

    Attributes:
        outside_lifetime_ns: After so long a program outside is silent.
    """

    def __init__(self, config: MuxConfig) -> None:
        self._lifetime_ns = {
            Source.OPERATOR: round(config.operator_s * NS_PER_S),
            Source.OUTSIDE: round(config.outside_s * NS_PER_S),
            Source.CONTROLLER: round(config.controller_s * NS_PER_S),
        }
        self.outside_lifetime_ns = self._lifetime_ns[Source.OUTSIDE]
        self._state_lifetime_ns = round(config.state_s * NS_PER_S)
        self._arrival_ns: dict[Source, int] = {}
        self._demands: dict[Source, Demand] = {}
        self._unused: set[Source] = set()
        self._state_arrival_ns: int | None = None
        self._is_outside = False

    def operate(self, demand: Demand, arrival_ns: int) -> None:
        """Take a demand of the operator; to be repeated as long as it is wanted."""
        self._offer(Source.OPERATOR, demand, arrival_ns)

    def control(self, demand: Demand, arrival_ns: int) -> None:
        """Take a demand of the controller."""
        self._offer(Source.CONTROLLER, demand, arrival_ns)

    def command_from_outside(self, demand: Demand, arrival_ns: int) -> None:
        """Take a demand of a program outside; from the first one on the vehicle is its."""
        self._offer(Source.OUTSIDE, demand, arrival_ns)
        self._is_outside = True

    def give_back(self) -> None:
        """The controller flies it again."""
        self._is_outside = False
        self._arrival_ns.pop(Source.OUTSIDE, None)

    def forget(self) -> None:
        """Forget demands: those that were made before valves may open do not come to life then."""
        self._arrival_ns.clear()

    def receive_state(self, arrival_ns: int) -> None:
        """Note that a state estimate arrived."""
        self._state_arrival_ns = arrival_ns

    def select(self, stamp_ns: int) -> Selection[Demand]:
        """Who commands at this moment, and why."""
        flown_by = Source.OUTSIDE if self._is_outside else Source.CONTROLLER
        for source in (Source.OPERATOR, flown_by):
            if self._is_fresh(source, stamp_ns):
                is_new = source in self._unused
                self._unused.discard(source)
                return Selection(source, self._demands[source], is_new, f"{source.value} is fresh")
        return self.brake(stamp_ns, self._silence(flown_by, stamp_ns))

    def brake(self, stamp_ns: int, reason: str) -> Selection[Demand]:
        """Brake while there is a state to brake on; else all valves close."""
        if self._state_arrival_ns is None:
            return Selection(Source.CLOSED, None, False, f"{reason}; no state ever arrived to brake with")
        age_ns = stamp_ns - self._state_arrival_ns
        if age_ns > self._state_lifetime_ns:
            why = f"{reason}; state is {_ms(age_ns)} ms old, too old to brake with"
            return Selection(Source.CLOSED, None, False, why)
        return Selection(Source.BRAKE, None, False, reason)

    def _offer(self, source: Source, demand: Demand, arrival_ns: int) -> None:
        self._arrival_ns[source] = arrival_ns
        self._demands[source] = demand
        self._unused.add(source)

    def _is_fresh(self, source: Source, stamp_ns: int) -> bool:
        arrival_ns = self._arrival_ns.get(source)
        return arrival_ns is not None and stamp_ns - arrival_ns <= self._lifetime_ns[source]

    def _silence(self, source: Source, stamp_ns: int) -> str:
        arrival_ns = self._arrival_ns.get(source)
        if arrival_ns is None:
            return f"nothing received from the {source.value} yet"
        return f"{source.value} silent for {_ms(stamp_ns - arrival_ns)} ms"


def _ms(span_ns: int) -> int:
    return span_ns // 1_000_000
