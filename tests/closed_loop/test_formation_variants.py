"""Each way of following, each closed curve, and who is down on a way: flown in lockstep."""

from pathlib import Path

import numpy as np
import pytest

from groundstation import scenario

RIG = Path(__file__).parents[2] / "examples" / "rigs" / "two_mock_ups_drawn.toml"
FOLLOWED = """
name = "followed"
rig = "{rig}"
duration_s = 60.0
seed = 1

[vehicles.alpha]
start = {{ {start} }}
control = {{ controller = "{controller}", parameters = {{ {leads} }} }}
[vehicles.beta]
start = {{ {beside} }}
control = {{ controller = "follow", parameters = {{ leader = "alpha", distance_m = 0.8, {follows} }} }}

[[limits]]
what = "position_error_rms_mm"
vehicle = "alpha"
from_s = 15.0
below = 8.0
[[limits]]
what = "distance_error_rms_mm"
vehicle = "followers"
from_s = 15.0
below = 8.0
[[limits]]
what = "contacts"
vehicle = "all"
below = 1.0
[[limits]]
what = "faults"
vehicle = "all"
below = 1.0
"""
POINTING = """[[limits]]
what = "pointing_error_rms_deg"
vehicle = "beta"
from_s = 15.0
below = 0.5
"""
PERIMETER = 'shape = "perimeter", size_m = [1.4, 0.9], centre_m = [-0.5, -0.6], speed_m_s = 0.06'
EIGHT = 'shape = "figure_eight", size_m = [1.5, 0.7], centre_m = [-0.4, -0.6], speed_m_s = 0.045'


@pytest.fixture
def flown(tmp_path):
    """Flies a scenario from its text; it has to pass."""

    def make(text):
        path = tmp_path / "scenario.toml"
        path.write_text(text)
        done = scenario.run(scenario.load(path))
        assert done.passed, done.reason
        return done

    return make


def followed(controller, leads, start, beside, follows):
    text = FOLLOWED.format(
        rig=RIG.as_posix(), controller=controller, leads=leads, start=start, beside=beside, follows=follows
    )
    return text if "face = false" in follows else text + POINTING


def bearings_deg(done, after_s, in_frame_of_leader=False):
    """Direction from leader to follower by truth."""
    t_s, x_m, y_m, heading_rad, *_ = done.truth("alpha")
    other_s, other_x_m, other_y_m, *_ = done.truth("beta")
    x_m, y_m, heading_rad = (np.interp(other_s, t_s, row) for row in (x_m, y_m, heading_rad))
    bearing_rad = np.arctan2(other_y_m - y_m, other_x_m - x_m)
    if in_frame_of_leader:
        bearing_rad = bearing_rad - heading_rad
    return np.degrees(np.unwrap(bearing_rad))[other_s > after_s]


@pytest.mark.slow
def test_with_a_free_bearing_the_follower_faces_a_leader_on_a_figure_eight(flown):
    done = flown(
        followed(
            "path",
            EIGHT,
            "x_m = -0.4, y_m = -0.6, heading_deg = 0.0",
            "x_m = -0.4, y_m = 0.2, heading_deg = -90.0",
            'bearing = "free", face = true',
        )
    )
    assert np.ptp(bearings_deg(done, 15.0)) > 20.0  # nothing holds it


@pytest.mark.slow
def test_a_bearing_of_the_table_is_held_while_the_leader_drives_the_perimeter(flown):
    done = flown(
        followed(
            "path",
            PERIMETER,
            "x_m = -0.5, y_m = -1.05, heading_deg = 0.0",
            "x_m = -0.5, y_m = -0.25, heading_deg = -90.0",
            'bearing = "table", bearing_deg = 90.0, face = true',
        )
    )
    assert bearings_deg(done, 15.0) == pytest.approx(90.0, abs=2.0)


@pytest.mark.slow
def test_a_bearing_of_the_leader_turns_with_it_and_the_heading_is_the_goals(flown):
    done = flown(
        followed(
            "tumble",
            "rate_deg_s = 2.5",
            "x_m = 0.0, y_m = 0.0, heading_deg = 0.0",
            "x_m = 0.8, y_m = 0.0, heading_deg = 30.0",
            'bearing = "leader", bearing_deg = 0.0, face = false',
        )
    )
    assert bearings_deg(done, 15.0, in_frame_of_leader=True) == pytest.approx(0.0, abs=2.0)
    assert np.ptp(bearings_deg(done, 15.0)) > 90.0  # it went round with it
    t_s, _, _, heading_rad, *_ = done.truth("beta")
    assert np.degrees(heading_rad[t_s > 15.0]) == pytest.approx(30.0, abs=1.0)


LIES = f"""
name = "who is down is an obstacle"
rig = "{RIG.as_posix()}"
duration_s = 40.0
seed = 1
changes = {{ "mock_ups.standard.fusion.rest_s" = 1.0 }}

[vehicles.alpha]
start = {{ x_m = -1.2, y_m = 0.0, heading_deg = 0.0 }}
[vehicles.beta]
start = {{ x_m = 0.1, y_m = 0.05, heading_deg = 90.0 }}
may_land = true

[[timeline]]
at_s = 1.0
vehicle = "beta"
request = "%s"
[[timeline]]
at_s = 6.0
vehicle = "alpha"
request = "go_to"
arguments = {{ x_m = 1.2, y_m = 0.0, heading_deg = 0.0 }}

[[limits]]
what = "contacts"
vehicle = "all"
below = 1.0
[[limits]]
what = "least_distance_mm"
vehicles = ["alpha", "beta"]
above = 10.0
"""


@pytest.mark.slow
@pytest.mark.parametrize("request_", ["land", "stop", "brake"])
def test_who_lands_or_stops_is_an_obstacle_to_the_others(flown, request_):
    done = flown(LIES % request_)
    assert done["alpha-beta.least_distance_mm"] < 150.0  # it came near, and stands before it
    t_s, x_m, *_ = done.truth("alpha")
    assert x_m[-1] < -0.3
    assert x_m[t_s > 30.0].max() < -0.3
