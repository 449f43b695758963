"""A controller that is changed in flight: the mock-up holds, then the new program flies, watched over."""

from pathlib import Path

import pytest

from groundstation import scenario
from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.scenario.messages import ScenarioStatus
from groundstation.parts.supervision.messages import Faults
from groundstation.runners.make_runner import make_runner

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "two_mock_ups_drawn.toml"
FOLLOW = """
name = "beta is told to follow alpha"
rig = "{rig}"
duration_s = {duration_s}

[[timeline]]
at_s = 2.0
vehicle = "beta"
request = "change_controller"
arguments = {{ controller = "follow", parameters = '{{"leader": "alpha", "distance_m": 0.9, "face": true}}' }}
[[timeline]]
at_s = 4.0
vehicle = "beta"
request = "resume"
{rows}
[[limits]]
what = "contacts"
vehicle = "all"
below = 1.0
"""
GO = """
[[timeline]]
at_s = 30.0
vehicle = "alpha"
request = "go_to"
arguments = { x_m = -0.6, y_m = 0.5, heading_deg = 0.0 }
"""
SILENT = """
[[timeline]]
at_s = 30.0
vehicle = "alpha"
failure = "silent_imu"
for_s = 10.0
"""


@pytest.fixture
def flown(tmp_path):
    """Flies a scenario; its messages with their moments."""

    def fly(rows, duration_s):
        path = tmp_path / "scenario.toml"
        path.write_text(FOLLOW.format(rig=RIG, rows=rows, duration_s=duration_s))
        plan = scenario.load(path)
        found = []
        runner = make_runner(
            plan.rig, 3, [lambda delivered, now_ns: found.append((now_ns, delivered.payload))]
        )
        runner.run(round((duration_s + 40.0) * 1e9))
        runner.close()
        return found

    return fly


def _of(found, kind, vehicle):
    return [
        (at_ns, message)
        for at_ns, message in found
        if isinstance(message, kind) and message.vehicle == vehicle
    ]


@pytest.mark.slow
def test_it_follows_a_leader_that_it_was_given_in_flight(flown):
    found = flown(GO, 80.0)
    (last,) = [message for _, message in found if isinstance(message, ScenarioStatus)][-1:]
    assert (last.state, last.reason) == ("ended", "")
    zero_ns = last.zero_ns
    beta = [(at_ns - zero_ns, message) for at_ns, message in _of(found, ControlStatus, "beta")]
    held = [message for at_ns, message in beta if 2.6e9 < at_ns < 4e9]
    assert {message.controller for message in held} == {"follow"}
    assert len({message.goal_position_table_m for message in held}) == 1
    settled = [message.error_position_m for at_ns, message in beta if 60e9 < at_ns < 80e9]
    assert max(settled) < 0.02
    alpha = _of(found, ControlStatus, "alpha")[-1][1]
    (x, y), (leader_x, leader_y) = beta[-1][1].goal_position_table_m, alpha.goal_position_table_m
    assert ((x - leader_x) ** 2 + (y - leader_y) ** 2) ** 0.5 == pytest.approx(0.9, abs=0.03)


@pytest.mark.slow
def test_the_supervisor_watches_over_a_leader_that_was_given_in_flight(flown):
    found = flown(SILENT, 40.0)
    ids = {name for _, faults in _of(found, Faults, "beta") for name in faults.ids}
    assert "leader_old" in ids
