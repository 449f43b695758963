"""A follower beside its leader: what its wrenches were made from, and the setpoint that it reports."""

import math

import numpy as np
import pytest

from groundstation.bus.envelope import Cause
from groundstation.declarations.errors import RigError
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.reference.messages import ReferenceState
from groundstation.recording.causes import CauseIndex
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder

OFFSET_M = (0.6, -0.3)
FOLLOWER = """
[vehicles.beta]
mock_up = "standard"
bus_index = 1
imu = "laboratory:beta/imu"
fixes = "laboratory:beta/fixes"
reference = "laboratory:beta/reference"
hold = {{ x_m = -1.0, y_m = 0.9, heading_deg = 0.0 }}

[vehicles.beta.control]
controller = "formation"
parameters = {{ neighbours = {{ {neighbour} = {{ offset_m = [{x}, {y}] }} }} }}

[[laboratory.vehicles]]
name = "beta"
start_m = [0.75, -0.15]
start_heading_deg = 0.0
reference_rate_hz = 20.0
imu = {{ model = "published", averaging = 10 }}
camera = {{ source = "fixes", rate_hz = 1.5, delay_s = 0.6 }}
"""


def follower(neighbour="alpha"):
    """The sections of a second vehicle that stays beside another; its own hold is far from there."""
    return FOLLOWER.format(neighbour=neighbour, x=OFFSET_M[0], y=OFFSET_M[1])


def place_beside(leader):
    """Where the follower should be, from a state or a reference of the leader: x, y (m)."""
    cosine, sine = math.cos(leader.heading_rad), math.sin(leader.heading_rad)
    x, y = leader.position_table_m
    return x + cosine * OFFSET_M[0] - sine * OFFSET_M[1], y + sine * OFFSET_M[0] + cosine * OFFSET_M[1]


@pytest.fixture
def pair(fly):
    return fly(follower())


def test_each_wrench_of_a_follower_was_made_from_its_own_newest_state_and_its_leaders(pair, tmp_path):
    newest, found = {}, []

    def observe(delivered, _now_ns):
        envelope = delivered.envelope
        if isinstance(delivered.payload, VehicleState):
            newest[envelope.owner] = envelope.sequence
        elif isinstance(delivered.payload, Wrench):
            found.append((envelope, dict(newest)))

    path = tmp_path / "formation.mcap"
    with Recorder(path, RecordingInfo()) as recorder:
        pair.runner._observers += (observe, recorder.record)
        pair.run(14.0)
    own = [(envelope, states) for envelope, states in found if envelope.owner == "beta"]
    assert len(own) > 100
    with Recording(path) as recording:
        journaled = CauseIndex(recording)
    for envelope, states in own:
        assert envelope.trigger == Cause(VehicleState.TOPIC.noun, "beta", states["beta"])
        made_from = [cause for cause in journaled[envelope.as_cause()].causes if cause.noun == "state"]
        assert sorted(made_from) == [Cause("state", name, states[name]) for name in ("alpha", "beta")]


def test_a_follower_reports_the_setpoint_that_it_flies_to(pair):
    pair.run(18.0)
    reports = pair.of(ControlStatus, "beta", 5.0)
    leaders, hold = pair.of(VehicleState, "alpha"), pair.rig.vehicles["beta"].hold
    assert len(reports) > 50
    stamps_ns = np.array([state.stamp_ns for state in leaders])
    for report in reports:
        leader = leaders[np.searchsorted(stamps_ns, report.stamp_ns) - 1]
        assert math.dist(report.goal_position_table_m, place_beside(leader)) < 0.01
        assert math.dist(report.goal_position_table_m, (hold.x_m, hold.y_m)) > 1.0
    assert {report.controller for report in reports} == {"formation"}
    assert {report.controller for report in pair.of(ControlStatus, "alpha")} == {"station"}
    # and it is there, in truth
    truth, leader = pair.of(ReferenceState, "beta")[-1], pair.of(ReferenceState, "alpha")[-1]
    assert math.dist(truth.position_table_m, place_beside(leader)) < 0.04
    assert reports[-1].error_position_m < 0.04


@pytest.mark.parametrize("neighbour", ["alfa", "beta"])
def test_a_neighbour_that_is_no_other_vehicle_is_refused_with_its_key(fly, neighbour):
    with pytest.raises(RigError, match=rf"vehicles\.beta\.control\.parameters: '{neighbour}' is no other"):
        fly(follower(neighbour))
