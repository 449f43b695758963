"""From landed to flying, and what closes the valves when a node publishes nothing any more."""

import json

import numpy as np
import pytest

from groundstation.declarations.errors import RigError
from groundstation.declarations.node import Node
from groundstation.parts.control.messages import Wrench
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.supervision.messages import Supervision
from groundstation.parts.valves.messages import ValveCommand, ValveSelection, ValveStatus
from groundstation.runners.make_runner import make_runner
from groundstation.runners.slot import Slot

SILENT_S = 5.0


def mute(flight, name, silent_s=SILENT_S):
    """From then on nothing that a node publishes gets out, as if it had died."""
    slots = {slot.key: slot for slot in flight.runner._step.slots}
    slot = slots[f"alpha/{name}"]
    node = slot.node

    class Mute(Node):
        inputs, outputs = node.inputs, node.outputs

        def start(self, now_ns):
            return node.start(now_ns)

        def sources(self, payload):
            return node.sources(payload)

        def receive(self, message, now_ns):
            made = tuple(node.receive(message, now_ns))
            return made if now_ns < silent_s * 1e9 else ()

        def tick(self, now_ns):
            made = tuple(node.tick(now_ns))
            return made if now_ns < silent_s * 1e9 else ()

    assert isinstance(slot, Slot)
    slot.node = Mute(node.vehicle, node.tick_period_ns)


def test_the_start_goes_resting_armed_flying(fly):
    flight = fly().run(4.0)
    assert flight.modes() == ["resting", "armed", "flying"]
    before = flight.of(ValveStatus, stop_s=1.0)
    assert not any(status.floating or status.armed or status.open_mask for status in before)
    unarmed = [status for status in flight.of(ValveStatus) if status.floating and not status.armed]
    assert unarmed == []


def test_no_valve_opens_before_the_vehicle_flies(fly):
    flight = fly().run(4.0)
    flying_s = next(row.stamp_ns * 1e-9 for row in flight.of(Supervision) if row.mode == "flying")
    assert not any(status.open_mask for status in flight.of(ValveStatus, stop_s=flying_s))


@pytest.mark.provokes("controller_silent")
def test_a_silent_controller_makes_the_mux_brake(fly):
    flight = fly()
    mute(flight, "controller")
    flight.run(SILENT_S + 4.0)
    sources = {row.source for row in flight.of(ValveSelection, start_s=SILENT_S + 0.5)}
    assert sources == {"brake"}
    assert "controller_silent" in flight.faults()
    speeds = [row.velocity_table_m_s for row in flight.of(ReferenceState, start_s=SILENT_S + 3.5)]
    assert max(max(map(abs, speed)) for speed in speeds) < 0.005


def test_silence_of_a_moving_vehicles_controller_is_braked_within_three_tenths_of_a_second(fly):
    """From the last wrench to the first report of a valve that the brake opened."""
    flight = fly()
    mute(flight, "controller", silent_s=9.0)
    flight.run(4.5)
    flight.request("go_to", json.dumps({"x_m": -0.9, "y_m": 0.1, "heading_rad": 0.0}))
    flight.run(6.0)
    last_s = flight.of(Wrench)[-1].stamp_ns * 1e-9
    assert last_s == pytest.approx(9.0, abs=0.2)
    before = flight.of(ReferenceState, start_s=last_s)[0]
    assert np.hypot(*before.velocity_table_m_s) > 0.04
    first_s = next(
        row.stamp_ns * 1e-9 for row in flight.of(ValveSelection, start_s=last_s) if row.source == "brake"
    )
    pushed_s = next(row.stamp_ns * 1e-9 for row in flight.of(ValveStatus, start_s=first_s) if row.open_mask)
    assert first_s - last_s > 0.2  # two wrenches may be late
    assert pushed_s - last_s <= 0.3


def test_a_silent_mux_makes_the_guard_close(fly):
    flight = fly()
    mute(flight, "command_mux")
    flight.run(SILENT_S + 1.0)
    late = flight.of(ValveCommand, start_s=SILENT_S + 0.15)
    assert late
    assert not any(command.open_mask for command in late)
    assert {command.gate for command in late} == {"stale"}
    assert not any(status.open_mask for status in flight.of(ValveStatus, start_s=SILENT_S + 0.2))


def test_a_silent_guard_makes_the_valve_node_close(fly):
    flight = fly()
    mute(flight, "guard")
    flight.run(SILENT_S + 1.0)
    late = flight.of(ValveStatus, start_s=SILENT_S + 0.2)
    assert all(status.dead_man and not status.open_mask for status in late)


def test_a_rig_without_a_laboratory_has_no_virtual_time(fly):
    rig = fly().rig
    with pytest.raises(RigError, match=r"needs a \[laboratory\]"):
        make_runner(rig.model_copy(update={"laboratory": None}), 1, [])


def test_a_real_device_is_refused_in_virtual_time(fly):
    rig = fly().rig
    vehicle = rig.vehicles["alpha"].model_copy(update={"imu": "/dev/ttyUSB0"})
    with pytest.raises(RigError, match="'/dev/ttyUSB0' is real hardware"):
        make_runner(rig.model_copy(update={"vehicles": {"alpha": vehicle}}), 1, [])
