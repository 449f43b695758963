"""Where a vehicle is not sent, and what its controller receives of the others."""

import json
import math
from pathlib import Path

import pytest

from groundstation.control.keep_in import rectangle
from groundstation.control.state import BodyWrench, Goal
from groundstation.declarations.lease import Lease
from groundstation.declarations.request import Ack, Request
from groundstation.parts.control.controller_node import ControllerNode
from groundstation.parts.control.laws import Law
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.control.part import controller_node
from groundstation.parts.fusion.messages import FusionStatus, VehicleState
from groundstation.rig.read import load_rig

MS = 1_000_000
RIGS = Path(__file__).parents[5] / "examples" / "rigs"


class NotingLaw:
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
    return ControlStatus(0, vehicle, "station", (x_m, y_m), 0.0, 0.0, 0.0, (), ())


@pytest.fixture
def law():
    return NotingLaw()


def change(node, controller, **parameters):
    given = {"controller": controller, "parameters": json.dumps(parameters)}
    (ack,) = node.receive(Request(0, "alpha", 1, "anna", "change_controller", json.dumps(given)), 5)
    assert isinstance(ack, Ack)
    assert ack.accepted == (not ack.reason)
    return ack.reason


@pytest.fixture
def flown():
    """The controller of a mock-up of a rig."""
    return controller_node(load_rig(RIGS / "two_mock_ups_drawn.toml"), "alpha")


@pytest.fixture
def node(law):
    keep_in = rectangle((4.0, 3.0), margin_m=0.2)
    goal = Goal((0.0, 0.0), 0.0)
    of_rig = Law("station", law, neighbours=("beta",))
    return ControllerNode("alpha", of_rig, goal, keep_in, ("beta", "gamma"), 0.05)


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


def published(node):
    """The newest status that it publishes within half a second of a state."""
    now_ns = 1000 * MS
    take(node, state("alpha", 0.1, 0.2, stamp_ns=now_ns))
    found = [made for _ in range(3) for made in _ticked(node, now_ns) if isinstance(made, ControlStatus)]
    return found[-1]


def _ticked(node, now_ns):
    take(node, state("alpha", 0.1, 0.2, stamp_ns=now_ns))
    return list(node.tick(now_ns))


def test_it_is_changed_to_another_controller_and_holds_where_it_worked_for(flown):
    before = published(flown)
    assert change(flown, "station") == ""
    after = published(flown)
    assert (before.controller, after.controller) == ("go_to", "station")
    assert after.goal_position_table_m == before.goal_position_table_m
    assert after.goal_heading_rad == before.goal_heading_rad


def test_a_program_that_it_is_changed_to_waits_for_resume(flown):
    goal = published(flown).goal_position_table_m
    assert change(flown, "path", waypoints_m=[[1.0, 0.0], [1.0, 0.5]], speed_m_s=0.05) == ""
    held = published(flown)
    assert (held.controller, held.goal_position_table_m) == ("path", goal)
    take(flown, Request(0, "alpha", 2, "anna", "resume", "{}"))
    assert published(flown).goal_position_table_m != goal


def test_a_new_leader_is_reported_and_its_state_reaches_the_law(flown):
    assert change(flown, "follow", leader="beta", distance_m=0.8) == ""
    status = published(flown)
    assert (status.neighbours, status.led_by) == (("beta",), ("beta",))


def test_nobody_follows_who_follows_it_over_however_many(flown):
    gamma = ControlStatus(0, "gamma", "follow", (0.0, 0.0), 0.0, 0.0, 0.0, ("alpha",), ("alpha",))
    beta = ControlStatus(0, "beta", "follow", (0.0, 0.0), 0.0, 0.0, 0.0, ("gamma",), ("gamma",))
    take(flown, gamma, beta)
    reason = change(flown, "follow", leader="beta", distance_m=0.8)
    assert reason == "beta would be led by alpha itself: nobody would lead"
    assert published(flown).controller == "go_to"


@pytest.mark.parametrize(
    ("controller", "parameters", "words"),
    [
        ("warp", {}, "controller 'warp' is none of"),
        ("path", {"waypoints_m": [[0.0, 0.0]], "sped_m_s": 1.0}, "sped_m_s: is no parameter"),
        ("follow", {"leader": "nobody", "distance_m": 0.8}, "'nobody' is no other vehicle"),
        ("follow", {"leader": "alpha", "distance_m": 0.8}, "'alpha' is no other vehicle"),
        ("go_to", {"speed_m_s": -1.0}, "speed_m_s"),
        ("dock", {"target": "beta"}, "name the docking in the rig"),
        ("trajectory", {"places_m": [[0.0, 0.0], [1.0, 0.0]]}, "plans for all ships"),
    ],
)
def test_what_cannot_be_flown_is_refused_in_a_sentence_and_changes_nothing(
    flown, controller, parameters, words
):
    assert words in change(flown, controller, **parameters)
    assert published(flown).controller == "go_to"


def test_two_changes_at_once_that_make_a_circle_end_in_holding(flown):
    assert change(flown, "follow", leader="beta", distance_m=0.8) == ""
    take(flown, ControlStatus(0, "beta", "follow", (0.0, 0.0), 0.0, 0.0, 0.0, ("alpha",), ("alpha",)))
    status = published(flown)
    assert (status.controller, status.led_by) == ("go_to", ())


def test_a_change_does_not_keep_a_goal_outside_the_table(flown):
    assert change(flown, "follow", leader="beta", distance_m=2.5) == ""
    take(flown, Request(0, "alpha", 2, "anna", "resume", "{}"))
    for number in range(20):
        now_ns = (1000 + 50 * number) * MS
        take(flown, state("alpha", 1.0, 0.2, stamp_ns=now_ns), state("beta", -1.6, 0.2, stamp_ns=now_ns))
        list(flown.tick(now_ns))
    assert change(flown, "station") == ""
    (x_m, y_m) = published(flown).goal_position_table_m
    assert abs(x_m) < 2.0
    assert abs(y_m) < 1.5


@pytest.mark.parametrize("word", ["NaN", "Infinity", "-Infinity"])
def test_what_is_no_number_is_named(flown, word):
    given = json.dumps({"controller": "path", "parameters": f'{{"speed_m_s": {word}}}'})
    (ack,) = flown.receive(Request(0, "alpha", 1, "anna", "change_controller", given), 5)
    assert ack.reason == f"change_controller: the parameters hold {word}, expected finite numbers"


@pytest.mark.parametrize(
    ("controller", "parameters"),
    [("path", {"speed_m_s": 1e308}), ("tumble", {"rate_deg_s": 1e9}), ("station", {"observer_rad_s": 1e6})],
)
def test_wild_numbers_are_refused_on_one_line(flown, controller, parameters):
    reason = change(flown, controller, **parameters)
    assert reason.startswith("change_controller")
    assert "expected at most" in reason
    assert "\n" not in reason
    assert "pydantic" not in reason


@pytest.mark.parametrize("text", ["[]", "5", "{", "[" * 400])
def test_parameters_are_a_json_object(flown, text):
    given = json.dumps({"controller": "station", "parameters": text})
    (ack,) = flown.receive(Request(0, "alpha", 1, "anna", "change_controller", given), 5)
    assert ack.reason == "change_controller: the parameters are no JSON object"


def test_who_does_not_hold_control_changes_nothing(flown):
    take(flown, Lease(0, "", "bert", 10**12, ""))
    assert "bert" in change(flown, "station")
    assert published(flown).controller == "go_to"


def test_a_law_of_a_program_stays(node):
    assert "stays" in change(node, "go_to")
