"""A follower that knows its leader by its side camera: accuracy, the switch, a leader that is hidden."""

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.parts.control.messages import ControlStatus
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.relative_navigation.messages import LeaderState, RelativePose

START_S = 8.0
"""By then both fly and stand at 1.5 m."""
SWITCHED = [('leader_by = "side_camera"', 'leader_by = "star_fixes"')]
EMULATED = Path(__file__).parents[2] / "calibration" / "rigs" / "emulated"
HIDING = ("covered_side_camera", "dark_side_view", "frozen_side_camera", "silent_side_camera")


def failure(kind, vehicle, start_s, end_s, parameters=""):
    return (
        f'\n[[laboratory.failures]]\nkind = "{kind}"\nvehicle = "{vehicle}"\nstart_s = {start_s}\n'
        f"end_s = {end_s}\nparameters = {{ {parameters} }}\n"
    )


def truth(flight, vehicle):
    rows = flight.of(ReferenceState, vehicle)
    stamps = np.array([row.stamp_ns for row in rows], float)
    values = np.array([(*row.position_table_m, row.heading_rad) for row in rows])
    values[:, 2] = np.unwrap(values[:, 2])
    return lambda stamp_ns: np.array([np.interp(stamp_ns, stamps, column) for column in values.T])


def errors(flight, start_s):
    """Distance (m), bearing and heading (rad) of each sighting less the truth, and its normalised square."""
    own_at, other_at, found = truth(flight, "beta"), truth(flight, "alpha"), []
    for pose in flight.of(RelativePose, "beta", start_s):
        if pose.status != "solved":
            continue
        own, other = own_at(pose.stamp_ns), other_at(pose.stamp_ns)
        dx, dy = other[:2] - own[:2]
        cosine, sine = math.cos(own[2]), math.sin(own[2])
        place = np.array((cosine * dx + sine * dy, cosine * dy - sine * dx))
        bearing_rad = math.remainder(pose.bearing_body_rad - math.atan2(place[1], place[0]), math.tau)
        turn_rad = math.remainder(pose.relative_heading_rad - other[2] + own[2], math.tau)
        off = np.array((*(np.array(pose.position_body_m) - place), turn_rad))
        covariance = np.array(pose.covariance).reshape(3, 3)
        count = 3 if math.isfinite(covariance[2, 2]) else 2
        square = off[:count] @ np.linalg.solve(covariance[:count, :count], off[:count]) / count
        found.append((pose.range_m - math.hypot(dx, dy), bearing_rad, turn_rad, square))
    return np.array(found).T


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def distance_errors(flight, start_s, stop_s=1e9, keep_m=1.5):
    leader = truth(flight, "alpha")
    rows = flight.of(ReferenceState, "beta", start_s, stop_s)
    return np.array([math.dist(row.position_table_m, leader(row.stamp_ns)[:2]) - keep_m for row in rows])


@pytest.mark.slow
def test_distance_bearing_and_heading_at_one_and_a_half_metres_and_the_follower_keeps_it(fly):
    flight = fly(rig="side_camera", seed=3).run(START_S + 8.0)
    range_m, bearing_rad, turn_rad, squares = errors(flight, START_S)
    assert len(range_m) > 100
    assert rms(range_m) < 0.001
    assert rms(bearing_rad) < math.radians(0.1)
    assert rms(turn_rad) < math.radians(0.3)
    assert 0.05 < np.mean(squares) < 2.0
    assert rms(distance_errors(flight, START_S)) < 0.006
    assert flight.of(LeaderState, "beta", START_S)


@pytest.mark.slow
def test_a_plain_leader_is_seen_by_its_lit_part_without_its_heading(fly):
    plain = [('by = "markers"', 'by = "lit_part"'),
             ('bodies = "../../calibration/rigs/emulated/side_bodies.toml"\ndelay_s',
              'bodies = "../../calibration/rigs/emulated/side_bodies_plain.toml"\ndelay_s'),
             ('bodies = "../../calibration/rigs/emulated/side_bodies.toml" }',
              'bodies = "../../calibration/rigs/emulated/side_bodies_plain.toml" }')]  # fmt: skip
    flight = fly(rig="side_camera", seed=3, changes=plain).run(START_S + 5.0)
    range_m, bearing_rad, turn_rad, squares = errors(flight, START_S)
    assert len(range_m) > 60
    assert rms(range_m) < 0.005
    assert rms(bearing_rad) < math.radians(0.5)
    assert np.isnan(turn_rad).all()
    assert np.mean(squares) < 2.0
    assert all(math.isnan(row.heading_rad) for row in flight.of(LeaderState, "beta"))
    assert rms(distance_errors(flight, START_S)) < 0.006


@pytest.mark.slow
@pytest.mark.parametrize("kind", HIDING)
def test_a_leader_that_is_hidden_is_an_old_leader_and_comes_back(fly, kind):
    end_s = START_S + 9.0
    flight = fly(failure(kind, "beta", START_S, end_s), rig="side_camera", seed=3).run(START_S + 2.5)
    assert "leader_old" in flight.faults("beta", START_S)
    unseen = flight.of(RelativePose, "beta", START_S + 0.2)
    assert all(pose.status != "solved" and pose.reason for pose in unseen)
    assert bool(unseen) == (kind != "silent_side_camera")
    assert not flight.of(LeaderState, "beta", START_S + 0.2)
    assert flight.modes("beta")[-1] == "flying"  # it widens the distance, then holds its place
    goals = [row.goal_position_table_m[0] for row in flight.of(ControlStatus, "beta", START_S)]
    assert max(goals) - goals[0] > 0.05
    assert flight.run(5.0).modes("beta")[-1] == "holding"
    flight.run(end_s - START_S - 7.5 + 8.0)
    assert flight.of(LeaderState, "beta", end_s + 0.5)
    assert flight.modes("beta")[-1] == "flying"
    assert flight.modes("alpha")[-1] == "flying"


@pytest.mark.slow
def test_wrong_star_fixes_of_the_leader_move_a_follower_only_by_star_fixes(fly):
    wrong = failure("wrong_fixes", "alpha", 0.0, 100.0, "dx_m = 0.03, dy_m = 0.0, dheading_deg = 0.0")
    seen, told = (
        fly(wrong, rig="side_camera", seed=3, changes=changes).run(START_S + 6.0)
        for changes in ((), SWITCHED)
    )
    assert abs(np.mean(distance_errors(seen, START_S))) < 0.006
    assert abs(np.mean(distance_errors(told, START_S))) > 0.02
    assert seen.of(LeaderState, "beta", START_S)


@pytest.mark.slow
def test_by_star_fixes_a_covered_camera_changes_nothing(fly):
    covered = failure("covered_side_camera", "beta", START_S, 100.0)
    flight = fly(covered, rig="side_camera", seed=3, changes=SWITCHED).run(START_S + 4.0)
    assert flight.modes("beta")[-1] == "flying"
    assert "leader_old" not in flight.faults("beta", START_S)
    assert rms(distance_errors(flight, START_S)) < 0.006


THIRD = """
[vehicles.gamma]
mock_up = "standard"
bus_index = 2
imu = "laboratory:gamma/imu"
imu_serial_number = 3
fixes = "laboratory:gamma/fixes"
reference = "laboratory:gamma/reference"
hold = {{ x_m = {x_m}, y_m = {y_m}, heading_deg = 0.0 }}

[[laboratory.vehicles]]
name = "gamma"
start_m = [{x_m}, {y_m}]
start_heading_deg = 0.0
imu = {{ model = "published", averaging = 10, ftdi_latency_ms = 1 }}
camera = {{ source = "fixes", rate_hz = 15.0, delay_s = 0.015 }}
"""


def three_alike(fly, tmp_path, by, leader_y_m, third_m):
    """The leader, its follower and a third one that looks exactly like the leader."""
    kind = "side_bodies.toml" if by == "markers" else "side_bodies_plain.toml"
    text = (EMULATED / kind).read_text()
    alpha = text[text.index("[alpha]") : text.index("[beta]")]
    gamma = alpha.replace("[alpha]", "[gamma]")
    bodies = tmp_path / "bodies.toml"
    bodies.write_text(text.split("[gamma]")[0] + gamma)
    files = 'bodies = "../../calibration/rigs/emulated/side_bodies.toml"'
    changes = [
        ('by = "markers"', f'by = "{by}"'),
        (f"{files}\ndelay_s", f'bodies = "{bodies.as_posix()}"\ndelay_s'),
        (f"{files} }}", f'bodies = "{bodies.as_posix()}" }}'),
        ("hold = { x_m = -0.8, y_m = 0.0", f"hold = {{ x_m = -0.8, y_m = {leader_y_m}"),
        ("start_m = [-0.8, 0.0]", f"start_m = [-0.8, {leader_y_m}]"),
    ]
    third = THIRD.format(x_m=third_m[0], y_m=third_m[1])
    return fly(third, rig="side_camera", seed=3, changes=changes)


@pytest.mark.slow
@pytest.mark.parametrize("by", ["markers", "lit_part"])
def test_a_third_mock_up_that_looks_like_the_leader_is_not_followed(fly, tmp_path, by):
    """The camera sees gamma alone; the leader is beside its field of view."""
    flight = three_alike(fly, tmp_path, by, 1.2, (-0.7, 0.0)).run(START_S + 3.0)
    seen = flight.of(RelativePose, "beta", 5.0)
    assert len(seen) > 50
    assert {pose.status for pose in seen} == {"ambiguous"}
    assert all("is where gamma is" in pose.reason for pose in seen)
    assert not flight.of(LeaderState, "beta")
    assert "leader_old" in flight.faults("beta")


@pytest.mark.slow
@pytest.mark.parametrize("by", ["markers", "lit_part"])
def test_a_leader_is_followed_where_another_like_it_is_elsewhere(fly, tmp_path, by):
    flight = three_alike(fly, tmp_path, by, 0.0, (-0.8, 1.2)).run(START_S + 4.0)
    seen = flight.of(RelativePose, "beta", START_S)
    assert {pose.status for pose in seen} == {"solved"}
    assert rms(distance_errors(flight, START_S)) < 0.006
    assert "leader_old" not in flight.faults("beta")
