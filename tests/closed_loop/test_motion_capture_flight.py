"""A mock-up flies on motion capture alone: frame, pivot and delay of the rig are those of the system."""

import math

import numpy as np
import pytest

from groundstation.declarations.errors import RigError
from groundstation.frames import wrap_angle
from groundstation.parts.fusion.messages import FixAccount, VehicleState
from groundstation.parts.motion_capture.messages import CaptureFix
from groundstation.parts.reference.messages import ReferenceState

RIG = "motion_capture"


def errors(flight, start_s):
    """Estimate minus truth at the truth's stamps: x, y in m, heading in rad, and the sigmas told."""
    truth = {row.stamp_ns: row for row in flight.of(ReferenceState, start_s=start_s)}
    rows = []
    states = {row.stamp_ns // 10_000_000: row for row in flight.of(VehicleState, start_s=start_s)}
    for stamp_ns, true in truth.items():
        state = states.get(stamp_ns // 10_000_000)
        if state is None:
            continue
        age_s = (true.stamp_ns - state.stamp_ns) * 1e-9
        x, y = (p + v * age_s for p, v in zip(state.position_table_m, state.velocity_table_m_s, strict=True))
        turn = wrap_angle(state.heading_rad + state.rate_rad_s * age_s - true.heading_rad)
        rows.append((x - true.position_table_m[0], y - true.position_table_m[1], turn, *state.pose_sigma))
    return np.array(rows)


def test_a_mock_up_holds_its_pose_on_motion_capture(fly):
    flight = fly(rig=RIG).run(40.0)
    found = errors(flight, 15.0)
    assert len(found) > 500
    assert np.sqrt(np.mean(found[:, :2] ** 2)) < 2e-4
    assert np.sqrt(np.mean(found[:, 2] ** 2)) < math.radians(0.03)
    inside = np.abs(found[:, :3]) < 3.0 * found[:, 3:]
    assert inside.mean() > 0.97
    distance_m, turn_rad = flight.off_goal(start_s=30.0)
    assert np.sqrt(np.mean(distance_m**2)) < 3e-3
    assert np.abs(turn_rad).max() < math.radians(1.0)
    accounts = flight.of(FixAccount, start_s=5.0)
    assert {account.source for account in accounts} == {"motion_capture"}
    assert np.mean([account.used for account in accounts]) > 0.95


def test_a_body_that_is_hidden_is_refused_in_words_and_flown_through(fly):
    flight = fly(rig=RIG, changes=[("occlusion_rate_hz = 0.1", "occlusion_rate_hz = 1.0")]).run(15.0)
    refused = [fix for fix in flight.of(CaptureFix) if not fix.fix]
    assert refused
    assert {fix.reason for fix in refused} == {"not tracked"}
    assert np.abs(errors(flight, 8.0)[:, :2]).max() < 2e-3


def test_its_poses_serve_as_the_reference_where_there_is_no_other(fly):
    changes = [
        ('reference = "laboratory:alpha/reference"\n', ""),
        ("pivot_yaw_deg = 15.0 }", "pivot_yaw_deg = 15.0, is_reference = true }"),
    ]
    flight = fly(rig=RIG, changes=changes, short_rest=False).run(6.0)
    rows = flight.of(ReferenceState, start_s=1.0)
    assert len(rows) > 200
    assert max(math.hypot(*row.velocity_table_m_s) for row in rows) < 0.03  # it rests


def test_two_references_of_one_vehicle_are_refused(fly):
    with pytest.raises(RigError, match=r"vehicles\.alpha\.motion_capture\.is_reference"):
        fly(rig=RIG, changes=[("pivot_yaw_deg = 15.0 }", "pivot_yaw_deg = 15.0, is_reference = true }")])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('address = "laboratory:motion_capture"', 'address = "vicon"', "motion_capture.address"),
        ("[motion_capture]\naddress", "[motion_capture]\nupwards = 1\naddress", "motion_capture.upwards"),
        (
            'up = "y"\norigin_table_m = [0.4, -1.0, 0.05]\nyaw_deg = 35.0\nsigma',
            'up = "x"\nsigma',
            "motion_capture.up",
        ),
    ],
)
def test_what_is_wrong_is_refused_with_its_key(fly, old, new, words):
    with pytest.raises(RigError, match=words):
        fly(rig=RIG, changes=[(old, new)])
