"""Flying in virtual time: a whole rig in one thread, everything that it published kept in memory."""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.declarations.request import Request
from groundstation.rig.read import parse_rig
from groundstation.runners.make_runner import make_runner

RIGS = Path(__file__).parents[2] / "examples" / "rigs"
SHORT_REST = "\n[mock_ups.standard.fusion]\nrest_s = 1.0\n"


class Flight:
    """A lockstep run.

    Attributes:
        published: Payloads by class, in the order of their publication.
        envelopes: Theirs.
        stamps_ns: When each was published.
    """

    def __init__(self, text, seed, extra_nodes=(), requests=()):
        self.published = defaultdict(list)
        self.envelopes = defaultdict(list)
        self.stamps_ns = defaultdict(list)
        self.rigs = RIGS
        self.rig = parse_rig(text, RIGS / "test.toml")
        self.runner = make_runner(self.rig, seed, [self._keep], extra_nodes=extra_nodes, requests=requests)

    def _keep(self, delivered, now_ns):
        kind = type(delivered.payload)
        self.published[kind].append(delivered.payload)
        self.envelopes[kind].append(delivered.envelope)
        self.stamps_ns[kind].append(now_ns)

    def run(self, seconds):
        self.runner.run(round(seconds * 1e9))
        return self

    def request(self, action, arguments="", vehicle="alpha", request_id=7, author="operator"):
        """Hand in a request now; ``run`` goes on from here."""
        now_ns = self.runner.now_ns
        request = Request(now_ns, vehicle, request_id, author, action, arguments)
        self.runner.publish(Delivered(Envelope(Request.TOPIC, author, request_id, now_ns), request))

    def of(self, kind, vehicle="alpha", start_s=0.0, stop_s=1e9):
        """Payloads of one class and vehicle that were published in a span of time."""
        return [
            payload
            for payload, now_ns in zip(self.published[kind], self.stamps_ns[kind], strict=True)
            if payload.vehicle == vehicle and start_s * 1e9 <= now_ns < stop_s * 1e9
        ]

    def modes(self, vehicle="alpha", start_s=0.0):
        """The modes of a vehicle, each once for as long as it lasts."""
        from groundstation.parts.supervision.messages import Supervision

        found = []
        for ruling in self.of(Supervision, vehicle, start_s):
            if not found or found[-1] != ruling.mode:
                found.append(ruling.mode)
        return found

    def faults(self, vehicle="alpha", start_s=0.0):
        """Ids of the faults that a vehicle had."""
        from groundstation.parts.supervision.messages import Faults

        return {fault for row in self.of(Faults, vehicle, start_s) for fault in row.ids}

    def counters(self, node):
        """The newest counters of a node, by name."""
        from groundstation.parts.operation.messages import Diagnostics

        rows = [row for row in self.published[Diagnostics] if row.node == node]
        return dict(zip(rows[-1].keys, map(int, rows[-1].values), strict=True)) if rows else {}

    def off_goal(self, vehicle="alpha", start_s=0.0):
        """Truth against the held pose: distances (m) and turns (rad), one per reference sample."""
        from groundstation.frames import wrap_angle
        from groundstation.parts.reference.messages import ReferenceState

        hold = self.rig.vehicles[vehicle].hold
        rows = self.of(ReferenceState, vehicle, start_s)
        distances = [
            np.hypot(r.position_table_m[0] - hold.x_m, r.position_table_m[1] - hold.y_m) for r in rows
        ]
        turns = [wrap_angle(r.heading_rad - np.radians(hold.heading_deg)) for r in rows]
        return np.array(distances), np.array(turns)


@pytest.fixture
def fly():
    """Makes flights of an example rig with lines changed or added; they are closed at the end of the test."""
    flights = []

    def make(more="", *, rig="drawn_fixes", seed=1, short_rest=True, changes=(), extra_nodes=(), requests=()):
        text = (RIGS / f"{rig}.toml").read_text()
        for old, new in changes:
            assert text.count(old) == 1, old
            text = text.replace(old, new)
        flight = Flight(text + (SHORT_REST if short_rest else "") + more, seed, extra_nodes, requests)
        flights.append(flight)
        return flight

    yield make
    for flight in flights:
        flight.runner.close()
