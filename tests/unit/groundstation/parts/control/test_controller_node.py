"""Where a vehicle is not sent, and what its controller receives of the others."""

import json
import math

import pytest

from groundstation.control.keep_in import rectangle
from groundstation.control.state import BodyWrench, Goal
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.controller_node import ControllerNode
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.fusion.messages import FusionStatus, VehicleState

MS = 1_000_000


class Law:
    """Notes which neighbours it is given."""

    def __init__(self):
        self.given = []
        self.goal = None

    def reset(self):
        pass

    def setpoint(self, goal):
        return goal

    def update(self, state, goal, dt_s, *, applied, neighbours):
        del state, dt_s, applied
        self.given.append(dict(neighbours))
        self.goal = goal
        return BodyWrench((0.0, 0.0), 0.0)


def state(vehicle, x_m, y_m, status="flying", stamp_ns=0):
    return VehicleState(stamp_ns, vehicle, (x_m, y_m), 0.0, (0.0, 0.0), 0.0, (1e-3, 1e-3, 1e-3), status, 1)


def status(vehicle, x_m, y_m):
    return ControlStatus(0, vehicle, "station", (x_m, y_m), 0.0, 0.0, 0.0)


@pytest.fixture
def law():
    return Law()


@pytest.fixture
def node(law):
    keep_in = rectangle((4.0, 3.0), margin_m=0.2)
    goal = Goal((0.0, 0.0), 0.0)
    return ControllerNode("alpha", law, "station", goal, keep_in, ("beta",), ("beta", "gamma"), 0.05)


def send(node, x_m, y_m):
    text = json.dumps({"x_m": x_m, "y_m": y_m, "heading_rad": 0.0})
    (ack,) = node.receive(Request(0, "alpha", 1, "anna", "go_to", text), 5)
    assert isinstance(ack, Ack)
    return ack.reason


def take(node, *messages):
    for message in messages:
        assert list(node.receive(message, 1)) == []


@pytest.mark.parametrize("kind", ["flying", "lost"])
def test_it_is_not_sent_to_where_another_is_whatever_that_ones_estimator_is_doing(node, law, kind):
    take(node, state("gamma", 1.0, 0.0, kind), state("alpha", 0.0, 0.0))
    assert send(node, 0.9, 0.0) == "gamma is 0.10 m from there, 0.45 m are asked for"
    list(node.tick(2))
    assert law.goal.position_table_m == (0.0, 0.0)
    assert send(node, 0.5, 0.0) == ""
    list(node.tick(3))
    assert law.goal.position_table_m == (0.5, 0.0)


def test_it_is_not_sent_to_where_another_is_sent(node):
    take(node, state("beta", 1.0, 1.0), status("beta", -1.0, 0.0))
    assert send(node, -1.0, 0.3) == "the goal of beta is 0.30 m from there, 0.45 m are asked for"
    take(node, status("beta", 1.0, 1.0))
    assert send(node, -1.0, 0.3) == ""


def test_its_own_state_and_goal_are_no_hindrance(node):
    take(node, state("alpha", 0.1, 0.0))
    assert send(node, 0.1, 0.0) == ""


def test_the_law_is_given_its_neighbours_alone(node, law):
    take(node, state("alpha", 0.0, 0.0), state("beta", 1.0, 0.0), state("gamma", -1.0, 0.0))
    assert any(isinstance(made, Wrench) for made in node.tick(2))
    assert [set(given) for given in law.given] == [{"beta"}]


def test_a_neighbour_that_is_lost_is_not_given_to_the_law(node, law):
    take(node, state("alpha", 0.0, 0.0), state("beta", 1.0, 0.0, "lost"))
    list(node.tick(2))
    assert law.given == [{}]


def test_neighbours_come_at_their_full_rate_the_others_paced(node):
    assert node.sources(VehicleState) == ("alpha", "beta", "gamma")
    assert node.sources(ControlStatus) == ("beta", "gamma")
    assert node.sources(FusionStatus) == ("alpha",)
    paced = {name: node.takes_paced(VehicleState, name) for name in node.sources(VehicleState)}
    assert paced == {"alpha": False, "beta": False, "gamma": True}
    assert not node.takes_paced(ControlStatus, "gamma")


def test_what_lies_outside_the_table_is_refused_first(node):
    take(node, state("gamma", 1.7, 0.0))
    assert "outside the part of the table" in send(node, 1.9, 0.0)
    assert math.isclose(node.tick_period_ns, 50 * MS)
