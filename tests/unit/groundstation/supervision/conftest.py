"""A vehicle made of sightings alone: everything is fresh and well unless a test says otherwise."""

from dataclasses import replace

import pytest

from groundstation.control.keep_in import rectangle
from groundstation.control.state import ControlState
from groundstation.supervision.sightings import NodeSeen, Seen, Sightings
from groundstation.supervision.supervisor import Supervisor

PERIOD_NS = 20_000_000
PERSON = "anna"


def seen(
    now_ns, position=(0.0, 0.0), velocity=(0.0, 0.0), rate_rad_s=0.0, status="flying", sigma=(0.001,) * 3
):
    return Seen(now_ns, ControlState(position, velocity, 0.0, rate_rad_s), status, sigma)


def node(now_ns, **changes):
    usual = NodeSeen(now_ns, armed=False, floating=False, dead_man=False, pressure_pa=100e5, faults=0)
    return replace(usual, **changes)


def sightings(began_ns=0, **changes):
    """A table of 4 m by 3 m, less 0.2 m all round; braking takes 0.05 m/s off in a second."""
    return Sightings(rectangle((4.0, 3.0), margin_m=0.2), 0.05, 0.15, began_ns, **changes)


class Vehicle:
    """Plays the other side of a supervisor: what is ordered of the air is done within a period.

    Attributes:
        silent: What publishes nothing: of ``state``, ``node``, ``detector``, ``demand``.
        velocity: True one; braking takes it away.
        air_obeys: The valve node carries out orders.
    """

    def __init__(self, *, starts_by_itself=True, rest_s=8.0):
        self.sightings = sightings()
        self.supervisor = Supervisor(
            self.sightings, rest_s=rest_s, period_ns=PERIOD_NS, starts_by_itself=starts_by_itself
        )
        self.sightings.rest_s = rest_s
        self.sightings.fix_age_s = 0.5
        self.now_ns = 0
        self.silent = set()
        self.findings = {}
        self.position, self.velocity = (0.0, 0.0), (0.0, 0.0)
        self.status, self.sigma = "flying", (0.001,) * 3
        self.floating = False
        self.air_obeys = True
        self.modes = []

    @property
    def mode(self):
        return self.supervisor.mode

    @property
    def ruling(self):
        return self.supervisor.ruling()

    @property
    def faults(self):
        return [row.fault.id for row in self.supervisor.board]

    def step(self):
        """A period passes."""
        self.now_ns += PERIOD_NS
        now_ns, ruling, seen_now = self.now_ns, self.ruling, self.sightings
        if self.air_obeys:
            self.floating = ruling.is_air_on
        if "state" not in self.silent:
            seen_now.own = seen(now_ns, self.position, self.velocity, 0.0, self.status, self.sigma)
        if "node" not in self.silent:
            seen_now.node = node(now_ns, armed=ruling.may_open, floating=self.floating)
        if "detector" not in self.silent:
            seen_now.findings, seen_now.findings_ns = dict(self.findings), now_ns
        if "demand" not in self.silent:
            seen_now.demand_ns = now_ns
        changed = self.supervisor.look(now_ns)
        if not self.modes or self.modes[-1] is not self.mode:
            self.modes.append(self.mode)
        return changed

    def run(self, span_s):
        """Time passes; returns the modes that were gone through."""
        self.modes = []
        for _ in range(round(span_s * 1e9) // PERIOD_NS):
            self.step()
        return [str(mode) for mode in self.modes]

    def ask(self, event, override=""):
        return self.supervisor.request(event, PERSON, self.now_ns, override)

    def press(self, press_id, author=PERSON):
        return self.supervisor.press(author, press_id, self.now_ns)

    def fly(self):
        """Take off, from the beginning."""
        modes = self.run(1.0)
        assert modes == ["armed", "flying"]
        return self


@pytest.fixture
def vehicle():
    return Vehicle()


@pytest.fixture
def flying():
    return Vehicle().fly()


@pytest.fixture
def landed():
    vehicle = Vehicle(starts_by_itself=False)
    vehicle.run(0.1)
    return vehicle


@pytest.fixture(name="seen")
def seen_fixture():
    return seen


@pytest.fixture(name="node")
def node_fixture():
    return node


@pytest.fixture(name="sightings")
def sightings_fixture():
    return sightings
