"""Every request is answered, by the one who carries it out, and what makes no sense is refused."""

import json
import math

import pytest

from groundstation.declarations.request import Ack
from groundstation.parts.operation.messages import SequencePhase
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.table import installed_tables
from groundstation.parts.valves.messages import ValveCommand, ValveSelection, ValveStatus, VehicleMode

ACTIONS = installed_tables().actions


def ask(flight, action, request_id=7, **arguments):
    """Hand in an operator's request now and fly on; its acks."""
    flight.request(action, json.dumps(arguments) if arguments else "", request_id=request_id)
    flight.run(0.5)
    return [ack for ack in flight.of(Ack) if ack.author == "operator" and ack.request_id == request_id]


@pytest.mark.parametrize("action", [name for name in ACTIONS if name != "picture"])
def test_a_known_request_is_answered_once(fly, action):
    flight = fly().run(2.5)
    values = {float: 0.1, str: "stuck_gyro"}
    arguments = {
        argument.name: values[argument.kind]
        for argument in ACTIONS[action].arguments
        if argument.default is None
    }
    answers = ask(flight, action, **arguments)
    assert [(ack.action, ack.accepted, ack.vehicle) for ack in answers] == [(action, True, "alpha")]


@pytest.mark.parametrize(
    ("action", "arguments", "reason"),
    [
        ("picture", {}, "this vehicle has no star tracker"),  # its fixes are drawn
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


def test_a_stop_is_latched_until_it_is_released(fly):
    flight = fly().run(3.0)
    ask(flight, "stop", request_id=1)
    assert not any(status.open_mask for status in flight.of(ValveStatus, start_s=3.1))
    assert flight.of(SequencePhase)[-1].phase == "stopped"
    (refused,) = ask(flight, "arm", request_id=2)
    assert "release it first" in refused.reason
    assert ask(flight, "release", request_id=3)[0].accepted
    assert flight.of(SequencePhase)[-1].phase == "disarmed"
    assert ask(flight, "arm", request_id=4)[0].accepted
    assert flight.of(ValveCommand)[-1].gate == "open"


def test_a_disarmed_vehicle_is_left_alone(fly):
    flight = fly().run(3.0)
    ask(flight, "disarm")
    flight.run(3.0)
    assert flight.of(SequencePhase)[-1].phase == "disarmed"
    assert not flight.of(VehicleMode)[-1].armed


def test_braking_holds_until_it_is_resumed(fly):
    flight = fly().run(3.0)
    ask(flight, "brake", request_id=1)
    assert flight.of(ValveSelection)[-1].source == "brake"
    ask(flight, "resume", request_id=2)
    assert flight.of(ValveSelection)[-1].source == "controller"
