"""A scenario flown live: its verdict is the exit code, its recording replays, a broken limit is named."""

import os
import signal

import pytest

from groundstation.cli.main import call
from groundstation.declarations.request import Request
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.scenario.messages import Marker, ScenarioStatus
from groundstation.recording.reader import Recording

pytestmark = pytest.mark.slow

SCENARIO = """
name = "live"
rig = "{rig}"
duration_s = 8.0

[vehicles.alpha]
start = {{ x_m = -0.5, y_m = 0.3, heading_deg = 20.0 }}
[vehicles.beta]
may_land = true
laboratory = {{ mass_kg = 10.5 }}

[[timeline]]
at_s = 1.0
vehicle = "alpha"
request = "go_to"
arguments = {{ x_m = -0.4, y_m = 0.1, heading_deg = 30.0 }}
[[timeline]]
at_s = 2.0
vehicle = "all"
failure = "dead_sky"
for_s = 0.5
[[timeline]]
at_s = 3.0
vehicle = "beta"
request = "land"
[[timeline]]
when = "beta.landed"
timeout_s = 4.0
mark = "beta is down"

[[limits]]
what = "contacts"
vehicle = "all"
below = 1.0
[[limits]]
what = "gas_ns"
vehicle = "alpha"
{gas}
"""


@pytest.fixture
def scenario(two_drawn, tmp_path):
    """Writes a scenario of two mock-ups with drawn fixes."""

    def write(gas):
        path = tmp_path / "scenario.toml"
        path.write_text(SCENARIO.format(rig=two_drawn, gas=gas))
        return path

    return write


def test_a_scenario_that_holds_ends_with_0_by_itself_and_replays(launch, scenario, capsys):
    run = launch(scenario("above = 0.0"))
    code, said = run.ends_by_itself()
    assert code == 0, said
    assert "verdict: passed" in said
    assert "marker: beta is down" in said
    with Recording(run.recording) as recording:
        (marker,) = [each.payload for each in recording.delivered([Marker])]
        states = [each.payload.state for each in recording.delivered([ScenarioStatus])]
        truth = next(
            each.payload for each in recording.delivered([ReferenceState]) if each.payload.vehicle == "alpha"
        )
    assert truth.position_table_m == pytest.approx(
        (-0.5, 0.3), abs=0.01
    )  # the scenario's start, not the rig's
    assert marker.text == "beta is down"
    assert states[-1] == "ended"
    assert call(["replay", str(run.recording)]) == 0, capsys.readouterr().out


def test_a_limit_that_breaks_ends_with_1_and_is_named(launch, scenario):
    run = launch(scenario("below = 0.001"))
    code, said = run.ends_by_itself()
    assert code == 1, said
    assert "FAILED gas_ns of alpha is " in said
    assert "verdict: failed: gas_ns of alpha" in said


def test_a_player_that_dies_ends_the_run_and_asks_nothing_twice(launch, scenario):
    run = launch(scenario("above = 0.0"))
    run.wait_for("scenario running, 1 rows done")
    os.kill(run.pids()["station"], signal.SIGKILL)
    code, said = run.ends_by_itself()
    assert code == 1, said
    assert "verdict: failed: " in said
    assert "started again" in said
    with Recording(run.recording) as recording:
        asked = [each.payload for each in recording.delivered([Request]) if each.payload.author == "scenario"]
    assert [each.action for each in asked].count("go_to") == 1
