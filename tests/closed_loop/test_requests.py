"""Every request is answered, by the one who carries it out, and what makes no sense is refused."""

import json
import math

import pytest

from groundstation.declarations.request import Ack
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.table import installed_tables
from groundstation.parts.valves.messages import ValveSelection, ValveStatus

ACTIONS = installed_tables().actions


def ask(flight, action, request_id=7, **arguments):
    """Hand in an operator's request now and fly on; its acks."""
    flight.request(action, json.dumps(arguments) if arguments else "", request_id=request_id)
    flight.run(0.5)
    return [ack for ack in flight.of(Ack) if ack.author == "operator" and ack.request_id == request_id]


FIRST = {
    "fly": ["land"],
    "release": ["stop"],
    "float_on": ["land"],
    "arm": ["land"],
    "resume": ["brake"],
    "give_control": ["take_control"],
}
"""What has to be asked for before an action counts."""


LACKING = ("picture", "start_scenario")
"""What the rig of these tests has nobody for."""


@pytest.mark.parametrize("action", [name for name in ACTIONS if name not in LACKING])
def test_a_known_request_is_answered_once(fly, action):
    flight = fly().run(4.0)
    for number, before in enumerate(FIRST.get(action, [])):
        assert ask(flight, before, request_id=100 + number)[0].accepted
    flight.run(6.0)
    names = {"failure": "stuck_gyro", "controller": "go_to"}
    arguments = {
        argument.name: names[argument.name] if argument.kind is str else 0.1
        for argument in ACTIONS[action].arguments
        if argument.default is None
    }
    answers = ask(flight, action, **arguments)
    assert [(ack.action, ack.accepted, ack.vehicle, ack.reason) for ack in answers] == [
        (action, True, "alpha", "")
    ]


@pytest.mark.parametrize(
    ("action", "arguments", "reason"),
    [
        ("picture", {}, "this vehicle has no star tracker"),  # its fixes are drawn
        ("start_scenario", {}, "this vehicle has no player"),
        ("fire", {}, "unknown action 'fire'"),
        ("go_to", {"x_m": 0.1, "y_m": 0.2}, "go_to needs heading_rad"),
        ("go_to", {"x_m": math.nan, "y_m": 0.0, "heading_rad": 0.0}, "finite"),
        ("go_to", {"x_m": 1.95, "y_m": 0.0, "heading_rad": 0.0}, "outside the part of the table"),
        ("arm", {"x_m": 1.0}, "arm has no argument 'x_m'"),
    ],
)
def test_what_cannot_be_done_is_refused_with_the_reason(fly, action, arguments, reason):
    flight = fly().run(2.5)
    (ack,) = ask(flight, action, **arguments)
    assert not ack.accepted
    assert reason in ack.reason


def test_a_vehicle_goes_where_it_is_told(fly):
    flight = fly().run(3.0)
    assert ask(flight, "go_to", x_m=-0.1, y_m=-0.1, heading_rad=math.radians(30.0))[0].accepted
    flight.run(15.0)
    truth = flight.of(ReferenceState)[-1]
    assert math.dist(truth.position_table_m, (-0.1, -0.1)) < 0.02
    assert abs(truth.heading_rad - math.radians(30.0)) < math.radians(2.0)


def test_a_stop_brakes_holds_lands_and_is_latched_until_a_person_releases_it(fly):
    flight = fly().run(4.0)
    ask(flight, "stop", request_id=1)
    flight.run(6.0)
    assert flight.modes(start_s=3.9) == ["flying", "braking", "holding", "landing", "stopped"]
    assert not flight.of(ValveStatus)[-1].floating
    (refused,) = ask(flight, "arm", request_id=2)
    assert "a stop is latched by operator: release it first" in refused.reason
    assert not ask(flight, "fly", request_id=3)[0].accepted
    assert ask(flight, "release", request_id=4)[0].accepted
    assert flight.run(3.0).modes()[-1] == "landed"
    assert ask(flight, "fly", request_id=5)[0].accepted
    assert flight.run(4.0).modes()[-1] == "flying"


def test_a_second_press_cuts_everything_at_once_a_repeated_one_does_not(fly):
    flight = fly().run(4.0)
    ask(flight, "stop", request_id=1)
    ask(flight, "stop", request_id=1)
    assert flight.modes()[-1] in ("braking", "holding")
    ask(flight, "stop", request_id=2)
    assert flight.modes()[-1] == "stopped"


@pytest.mark.parametrize("action", ["land", "disarm", "float_off"])
def test_what_a_person_landed_stays_landed_until_a_person_lets_it_fly(fly, action):
    flight = fly().run(4.0)
    asked_s = flight.runner.now_ns * 1e-9
    ask(flight, action)
    flight.run(10.0)
    assert flight.modes()[-1] == "landed"
    late = flight.of(ValveStatus, start_s=asked_s + 0.1)
    assert not any(status.floating or status.open_mask or status.armed for status in late)
    flight.request("fly", request_id=9)
    assert flight.run(4.0).modes()[-1] == "flying"


def test_an_unarmed_vehicle_floats_by_a_persons_explicit_wish_only(fly):
    flight = fly("\n", changes=[("[vehicles.alpha]", "[vehicles.alpha]\nstarts_by_itself = false")])
    flight.run(4.0)
    assert flight.modes() == ["landed"]
    assert ask(flight, "float_on", request_id=1)[0].accepted
    status = flight.of(ValveStatus)[-1]
    assert (status.floating, status.armed) == (True, False)
    assert ask(flight, "arm", request_id=2)[0].accepted
    assert flight.run(1.0).modes()[-1] == "flying"


def test_braking_holds_until_it_is_resumed(fly):
    flight = fly().run(3.0)
    ask(flight, "brake", request_id=1)
    assert flight.of(ValveSelection)[-1].source == "brake"
    ask(flight, "resume", request_id=2)
    assert flight.of(ValveSelection)[-1].source == "controller"
