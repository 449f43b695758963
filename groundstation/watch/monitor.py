"""What a person wants to know of a running rig: rows of the view, lines of the log, events, latency.

The monitor takes every message, live from the record stream or in lockstep. It knows no messages: what is
shown of them is declared by the parts (gauges). It publishes nothing and decides nothing.

Thousands of messages come a second and people look a few times: only what a gauge takes one by one is decoded
when it comes; of the rest the newest bytes are kept until somebody looks.
"""

from collections import deque
from collections.abc import Collection, Iterable
from dataclasses import dataclass

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.envelope import Delivered
from groundstation.bus.record_stream import Recorded
from groundstation.declarations.message import Message
from groundstation.declarations.tables import Tables
from groundstation.declarations.topic import Scope
from groundstation.declarations.view import Gauge
from groundstation.parts.operation.messages import Diagnostics, Latency
from groundstation.watch.health import Health
from groundstation.watch.ledger import FOLLOWED, Ledger
from groundstation.watch.vehicle_monitor import VehicleMonitor

EVENTS_KEPT = 8


@dataclass(frozen=True, slots=True)
class _Route:
    """What becomes of the messages of one class.

    Attributes:
        kind: The class.
        takers: Gauges that take each of them, by vehicle.
        is_decoded: Each is decoded when it comes.
        is_kept: Somebody wants the newest when he looks.
        is_rated: Somebody shows how often they come.
        is_followed: The ledger wants them.
    """

    kind: type[Message]
    takers: dict[str, tuple[Gauge, ...]]
    is_decoded: bool
    is_kept: bool
    is_rated: bool
    is_followed: bool


class Monitor:
    """Takes messages, answers questions.

    Args:
        tables: Of the parts whose gauges are shown.
        vehicles: Names of the vehicles.

    Attributes:
        vehicles: What is known of each.
        ledger: Of the latency.
        health: Of ports and nodes.
        latency: The newest summary of each vehicle.
        lines: The newest events.
        undecodable: Messages that do not fit the layout of their class.
    """

    def __init__(self, tables: Tables, vehicles: tuple[str, ...]) -> None:
        rows = sorted(
            (row for part in tables.parts.values() for row in part.gauges), key=lambda row: row.order
        )
        self.lines: deque[str] = deque(maxlen=EVENTS_KEPT)
        self._unread: list[str] = []
        self.undecodable = 0
        self._garbled: set[tuple[str, str]] = set()
        self.vehicles = {
            name: VehicleMonitor(name, tuple(row.make(name) for row in rows), self.note, self._count_garbled)
            for name in vehicles
        }
        self.ledger = Ledger()
        self.health = Health()
        self.latency: dict[str, Latency] = {}
        self._routes = {
            noun: route for noun, kind in tables.payloads.items() if (route := self._route(kind)) is not None
        }

    @property
    def nouns(self) -> Collection[str]:
        """Of the topics whose messages change anything here; all others need not be given."""
        return self._routes.keys()

    def take(self, recorded: Recorded, now_ns: int) -> None:
        """Account for one message of the record stream."""
        route = self._routes.get(recorded.noun)
        if route is None:
            return
        payload = None
        if route.is_decoded:
            try:
                payload = codec_of(route.kind).decode(recorded.data)
            except CodecError as error:
                self._count_garbled(recorded.owner, recorded.noun, error)
                return
        if route.is_followed:
            self.ledger.take(recorded, payload)
        if payload is not None:
            self._account(route, payload, now_ns)
            return
        for vehicle in self._concerned(recorded.owner):
            vehicle.is_known |= bool(recorded.owner)
            if route.is_rated:
                vehicle.newest.count(route.kind, now_ns)
            if route.is_kept:
                vehicle.undecoded[route.kind] = recorded.data

    def take_delivered(self, delivered: Delivered, now_ns: int) -> None:
        """Account for one message that was never encoded."""
        route = self._routes.get(delivered.envelope.topic.noun)
        if route is not None:
            if route.is_followed:
                self.ledger.take_delivered(delivered)
            self._account(route, delivered.payload, now_ns)

    def note(self, line: str) -> None:
        """Keep an event for people; the newest few are shown."""
        self.lines.append(line)
        self._unread.append(line)

    def take_lines(self) -> list[str]:
        """Events since the last call, for a log."""
        lines, self._unread = self._unread, []
        return lines

    def look(self, now_ns: int) -> None:
        """Let the gauges find what is silent or wrong; call about once a second."""
        for vehicle in self.vehicles.values():
            for line in vehicle.look(now_ns):
                self.note(line)

    def summarise_latency(self, now_ns: int) -> Iterable[Latency]:
        """Make the ledger's summaries; call about once a second and publish what it returns."""
        for name in self.vehicles:
            self.latency[name] = self.ledger.summary(name, now_ns)
        return tuple(self.latency.values())

    def _route(self, kind: type[Message]) -> _Route | None:
        gauges = [gauge for vehicle in self.vehicles.values() for gauge in vehicle.gauges]
        takers = {
            name: tuple(gauge for gauge in vehicle.gauges if kind in gauge.every)
            for name, vehicle in self.vehicles.items()
        }
        is_kept = any(kind in gauge.newest for gauge in gauges)
        is_rated = any(kind in gauge.rated for gauge in gauges)
        is_followed = FOLLOWED.get(kind.TOPIC.noun) is kind
        is_taken = any(takers.values()) or kind is Diagnostics
        if not (is_taken or is_kept or is_rated or is_followed):
            return None
        # whose a message of a process is, stands in the message alone
        is_decoded = is_taken or kind.TOPIC.scope is Scope.PROCESS
        return _Route(kind, takers, is_decoded, is_kept, is_rated, is_followed)

    def _concerned(self, vehicle: str) -> Iterable[VehicleMonitor]:
        """Whose view a message of a vehicle changes; what belongs to the rig concerns all."""
        found = self.vehicles.get(vehicle)
        if found is not None:
            return (found,)
        return () if vehicle else self.vehicles.values()

    def _account(self, route: _Route, payload: Message, now_ns: int) -> None:
        kind, name = route.kind, payload.vehicle
        events: dict[str, None] = {}  # what several vehicles' gauges make of one message is one event
        if isinstance(payload, Diagnostics):
            news = self.health.take(payload)
            if news:
                events[news] = None
        for vehicle in self._concerned(name):
            vehicle.is_known |= bool(name)
            if route.is_rated:
                vehicle.newest.count(kind, now_ns)
            if route.is_kept:
                vehicle.newest.put(payload)
            for event in vehicle.take(route.takers[vehicle.name], payload, now_ns):
                events[event] = None
        for event in events:
            self.note(event)

    def _count_garbled(self, owner: str, noun: str, error: CodecError) -> None:
        self.undecodable += 1
        if (owner, noun) not in self._garbled:
            self._garbled.add((owner, noun))
            self.note(f"a message on {owner}/{noun} cannot be decoded: {error}")
