"""The shell of the multiplexer: who commands the valves, told by messages alone."""

import json

import pytest

from groundstation.control.allocation import Allocator
from groundstation.control.brake import BrakeConfig
from groundstation.control.keep_in import rectangle
from groundstation.control.modulation import PulseConfig, PulseModulator
from groundstation.control.mux import MuxConfig
from groundstation.control.vehicle import VehicleModel, square_of_eight
from groundstation.declarations.request import Ack, Request
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.valves.command_mux_node import CommandMuxNode
from groundstation.parts.valves.messages import ValveDemand

MS = 1_000_000
MODEL = VehicleModel(11.0, 0.25, square_of_eight())


def modulator():
    return PulseModulator(Allocator(MODEL), PulseConfig())


@pytest.fixture
def mux():
    return CommandMuxNode(
        "alpha",
        MuxConfig(),
        BrakeConfig(),
        MODEL,
        (modulator(), modulator()),
        rectangle((4.0, 3.0), margin_m=0.2),
    )


def demand(on_ms, now_ns=0):
    return ValveDemand(now_ns, "alpha", bytes(on_ms), (0.0, 0.0), 0.0)


def state(now_ns, position=(0.0, 0.0), velocity=(0.0, 0.0)):
    return VehicleState(now_ns, "alpha", position, 0.0, velocity, 0.0, (1e-3, 1e-3, 1e-3), "flying", 1)


def request(action, **arguments):
    return Request(0, "alpha", 1, "operator", action, json.dumps(arguments))


def push(**arguments):
    return request(
        "push", **{"force_x_n": 0.2, "force_y_n": 0.0, "torque_nm": 0.0, "span_s": 0.3} | arguments
    )


def reported(outputs, kind):
    return [message for message in outputs if isinstance(message, kind)]


def test_a_new_demand_of_the_controller_goes_out_at_once(mux):
    (selection,) = mux.receive(demand([30] * 8), 5 * MS)
    assert (selection.source, selection.on_time_ms) == ("controller", bytes([30] * 8))


def test_an_old_demand_is_refreshed_and_not_started_again(mux):
    (first,) = mux.receive(demand([30] * 8), 5 * MS)
    (second,) = mux.tick(20 * MS)
    assert second.pulse_id == first.pulse_id
    assert second.counter == (first.counter + 1) % 16


def test_a_silent_controller_brakes_against_the_velocity(mux):
    list(mux.receive(demand([0] * 8), 0))
    list(mux.receive(state(400 * MS, velocity=(0.05, 0.0)), 400 * MS))
    (selection,) = mux.tick(420 * MS)
    assert selection.source == "brake"
    assert selection.on_time_ms[2] > 0
    assert selection.on_time_ms[3] > 0
    assert not any(selection.on_time_ms[:2])


def test_without_a_fresh_state_silence_closes_the_valves(mux):
    list(mux.receive(demand([30] * 8), 0))
    (selection,) = mux.tick(500 * MS)
    assert (selection.source, selection.on_time_ms) == ("closed", bytes(8))


def test_a_vehicle_that_would_leave_the_table_is_braked_whatever_the_controller_says(mux):
    list(mux.receive(state(0, position=(1.75, 0.0), velocity=(0.1, 0.0)), 0))
    list(mux.receive(demand([30] * 8), 0))
    (selection,) = mux.tick(20 * MS)
    assert selection.source == "brake"
    assert "edge" in selection.reason


def test_a_push_by_hand_outranks_the_controller_and_ends_by_itself(mux):
    list(mux.receive(state(0), 0))
    (ack,) = reported(mux.receive(push(), 0), Ack)
    assert ack.accepted
    sources = []
    for step in range(1, 40):
        now_ns = step * 20 * MS
        list(mux.receive(state(now_ns), now_ns))
        list(mux.receive(demand([0] * 8), now_ns))
        (selection,) = mux.tick(now_ns)
        sources.append(selection.source)
        if now_ns < 300 * MS:
            assert any(selection.on_time_ms[:2])
    assert sources[0] == "operator"
    assert sources[-1] == "controller"


def test_a_push_without_end_is_refused(mux):
    (ack,) = mux.receive(push(span_s=3600.0), 0)
    assert not ack.accepted
    assert "span_s is 3600, expected 0 to 10" in ack.reason


def test_a_stop_closes_until_it_is_released(mux):
    list(mux.receive(demand([30] * 8), 0))
    (selection,) = mux.receive(request("stop"), 10 * MS)
    assert (selection.source, selection.on_time_ms) == ("stop", bytes(8))
    list(mux.receive(demand([40] * 8), 20 * MS))
    (selection,) = mux.tick(40 * MS)
    assert selection.source == "stop"
    list(mux.receive(request("release"), 50 * MS))
    (selection,) = mux.receive(demand([50] * 8), 60 * MS)
    assert selection.source == "controller"
