"""Path and follower: where they want the mock-up, in closed form."""

import itertools
import math

import pytest

from groundstation.control.controllers import make_controller
from groundstation.control.keep_in import rectangle
from groundstation.control.state import ControlState, Goal
from groundstation.control.vehicle import VehicleModel, square_of_eight

VEHICLE = VehicleModel(11.0, 0.25, square_of_eight())
HERE = Goal((0.0, 0.0), 0.0)


def follow(**parameters):
    return make_controller("follow", {"leader": "leader", "distance_m": 0.8, **parameters}, VEHICLE)


def wanted(law, state, leader):
    law.update(state, HERE, 0.1, neighbours={"leader": leader})
    return law.setpoint(HERE)


@pytest.mark.parametrize("bearing_rad", [0.0, 2.0, -2.5])
def test_a_free_follower_keeps_its_bearing_and_faces_the_leader(bearing_rad):
    leader = ControlState((0.3, -0.2), (0.0, 0.0), 1.0, 0.0)
    away = (math.cos(bearing_rad), math.sin(bearing_rad))
    state = ControlState((0.3 + 1.1 * away[0], -0.2 + 1.1 * away[1]), (0.0, 0.0), 0.3, 0.0)
    goal = wanted(follow(), state, leader)
    assert goal.position_table_m == pytest.approx((0.3 + 0.8 * away[0], -0.2 + 0.8 * away[1]))
    assert math.cos(goal.heading_rad - bearing_rad) == pytest.approx(-1.0)
    assert goal.velocity_table_m_s == pytest.approx((0.0, 0.0))


def test_a_free_follower_takes_over_only_the_speed_along_the_way_to_its_leader():
    leader = ControlState((0.0, 0.0), (0.03, 0.05), 0.0, 0.0)
    goal = wanted(follow(), ControlState((-0.8, 0.0), (0.0, 0.0), 0.0, 0.0), leader)
    assert goal.velocity_table_m_s == pytest.approx((0.03, 0.0))
    assert goal.rate_rad_s == pytest.approx(0.05 / 0.8)  # the leader passes to the left: it turns after it


def after(law, leader_at, state, seconds=4.0, dt_s=0.1):
    """The setpoint once a moving leader has been watched for a while; the follower stays where it is."""
    for count in range(round(seconds / dt_s) + 1):
        law.update(state, HERE, dt_s, neighbours={"leader": leader_at(count * dt_s)})
    return law.setpoint(HERE)


def test_a_leader_that_speeds_up_takes_its_follower_along_at_once():
    def leader_at(t_s):
        return ControlState((0.8 + 0.0075 * t_s**2, 0.0), (0.015 * t_s, 0.0), 0.0, 0.0)

    goal = after(
        follow(bearing="table", bearing_deg=180.0), leader_at, ControlState((0, 0), (0, 0), 0.0, 0.0)
    )
    assert goal.acceleration_table_m_s2 == pytest.approx((0.015, 0.0), abs=1e-4)
    # facing along the line, no acceleration across it: the heading has none
    assert goal.angular_acceleration_rad_s2 == pytest.approx(0.0, abs=1e-9)


def test_a_leader_that_passes_is_kept_at_its_distance_by_the_acceleration_that_a_circle_takes():
    state = ControlState((-0.8, 0.0), (0.0, 0.0), 0.0, 0.0)
    goal = after(follow(), lambda t_s: ControlState((0.0, 0.06 * (t_s - 4.0)), (0.0, 0.06), 0.0, 0.0), state)
    # to hold r as the bearing turns at v / r takes v^2 / r towards the leader's circle: away stays 0.8 m
    assert goal.acceleration_table_m_s2 == pytest.approx((0.06**2 / 0.8, 0.0), abs=1e-5)


def test_a_place_carried_by_a_turning_leader_has_the_accelerations_of_its_circle():
    def leader_at(t_s):
        return ControlState((0.0, 0.0), (0.0, 0.0), 0.01 * (t_s - 4.0) ** 2, 0.2 + 0.02 * (t_s - 4.0))

    goal = after(
        follow(bearing="leader", bearing_deg=0.0), leader_at, ControlState((0.8, 0), (0, 0), 0.0, 0.0)
    )
    assert goal.acceleration_table_m_s2 == pytest.approx((-(0.2**2) * 0.8, 0.02 * 0.8), abs=2e-4)


def test_the_way_a_leader_speeds_up_is_forgotten_when_it_falls_silent():
    law, state = follow(bearing="table", bearing_deg=180.0), ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0)
    after(law, lambda t_s: ControlState((0.8, 0.0), (0.015 * t_s, 0.0), 0.0, 0.0), state)
    law.update(state, HERE, 0.1)
    assert law.setpoint(HERE).acceleration_table_m_s2 == (0.0, 0.0)
    law.update(state, HERE, 0.1, neighbours={"leader": ControlState((0.8, 0.0), (0.0, 0.0), 0.0, 0.0)})
    assert law.setpoint(HERE).acceleration_table_m_s2 == (0.0, 0.0)


def test_a_bearing_of_the_table_stays_one_of_the_leader_turns_with_it():
    leader = ControlState((0.0, 0.0), (0.0, 0.0), math.pi / 2, 0.1)
    state = ControlState((1.0, 0.0), (0.0, 0.0), 0.0, 0.0)
    table = wanted(follow(bearing="table", bearing_deg=180.0), state, leader)
    assert table.position_table_m == pytest.approx((-0.8, 0.0))
    carried = wanted(follow(bearing="leader", bearing_deg=180.0), state, leader)
    assert carried.position_table_m == pytest.approx((0.0, -0.8))
    assert carried.velocity_table_m_s == pytest.approx((0.08, 0.0))


def test_who_does_not_face_keeps_the_heading_of_its_goal():
    leader = ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0)
    state = ControlState((1.0, 0.0), (0.0, 0.0), 0.0, 0.0)
    assert wanted(follow(face=False), state, leader).heading_rad == 0.0


@pytest.mark.parametrize(
    ("parameters", "word"),
    [
        ({"bearing": "table"}, "bearing_deg"),
        ({"bearing_deg": 30.0}, "bearing"),
        ({"distance_m": 0.4}, "distance_m"),
    ],
)
def test_parameters_that_do_not_fit_are_refused(parameters, word):
    with pytest.raises(ValueError, match=word):
        follow(**parameters)


def flown(law, start, seconds, dt_s=0.1):
    """Setpoints of a mock-up that is always where the law wants it."""
    state, places = ControlState(start, (0.0, 0.0), 0.0, 0.0), []
    for _ in range(round(seconds / dt_s)):
        law.update(state, HERE, dt_s)
        goal = law.setpoint(HERE)
        state = ControlState(
            goal.position_table_m, goal.velocity_table_m_s, goal.heading_rad, goal.rate_rad_s
        )
        places.append(goal)
    return places


def path(**parameters):
    given = {"waypoints_m": [(0.5, 0.0), (0.5, 0.5)], "speed_m_s": 0.06, **parameters}
    return make_controller("path", given, VEHICLE, rectangle((4.0, 3.0), margin_m=0.2))


def test_waypoints_are_reached_one_after_the_other_within_speed_and_acceleration():
    places = flown(path(), (0.0, 0.0), 30.0)
    speeds = [math.hypot(*goal.velocity_table_m_s) for goal in places]
    assert max(speeds) == pytest.approx(0.06)
    steps = [math.dist(a.velocity_table_m_s, b.velocity_table_m_s) for a, b in itertools.pairwise(places)]
    assert max(steps) <= 0.015 * 0.1 * 1.001 + 1e-12
    corner = min(range(len(places)), key=lambda place: math.dist(places[place].position_table_m, (0.5, 0.0)))
    assert math.dist(places[corner].position_table_m, (0.5, 0.0)) < 1e-3
    assert speeds[corner] < 0.003
    assert math.dist(places[-1].position_table_m, (0.5, 0.5)) < 1e-3


def test_a_closed_path_goes_on_with_its_first_waypoint():
    places = flown(path(closed=True), (0.5, 0.0), 40.0)
    assert min(math.dist(goal.position_table_m, (0.5, 0.5)) for goal in places) < 1e-3
    late = places[len(places) // 2 :]
    assert min(math.dist(goal.position_table_m, (0.5, 0.0)) for goal in late) < 1e-3


def test_a_heading_is_held_or_points_along_the_way():
    assert {round(goal.heading_rad, 9) for goal in flown(path(), (0.0, 0.0), 20.0)} == {0.0}
    assert flown(path(heading="along"), (0.0, 0.0), 30.0)[-1].heading_rad == pytest.approx(
        math.pi / 2, abs=0.01
    )


def test_who_falls_far_behind_starts_from_where_it_is():
    law = path()
    flown(law, (0.0, 0.0), 5.0)
    law.update(ControlState((-0.5, 0.3), (0.0, 0.0), 0.0, 0.0), HERE, 0.1)
    assert math.dist(law.setpoint(HERE).position_table_m, (-0.5, 0.3)) < 0.01


@pytest.mark.parametrize(
    ("waypoints_m", "word"),
    [([], "waypoints_m"), ([(0.0, 0.0), (0.0, 0.0)], "same place"), ([(1.9, 0.0)], "waypoints_m.0")],
)
def test_ways_that_lead_nowhere_are_refused(waypoints_m, word):
    with pytest.raises(ValueError, match=word):
        path(waypoints_m=waypoints_m)


def test_a_leader_that_falls_silent_gets_more_room_and_then_the_place_is_held():
    law = make_controller("follow", {"leader": "leader", "distance_m": 0.8}, VEHICLE)
    leader = ControlState((0.0, 0.0), (0.0, 0.0), 0.0, 0.0)
    own, goal = ControlState((0.8, 0.0), (0.0, 0.0), math.pi, 0.0), Goal((0.8, 0.0), math.pi)
    law.update(own, goal, 0.1, neighbours={"leader": leader})
    assert law.setpoint(goal).position_table_m == pytest.approx((0.8, 0.0))
    places = []
    for _ in range(50):
        law.update(own, goal, 0.1)
        places.append(law.setpoint(goal))
    assert places[9].position_table_m == pytest.approx((0.85, 0.0))
    assert places[9].velocity_table_m_s == pytest.approx((0.05, 0.0))
    assert places[29].position_table_m == pytest.approx((0.95, 0.0), abs=0.006)
    assert places[-1].position_table_m == places[31].position_table_m
    assert places[-1].velocity_table_m_s == (0.0, 0.0)
    assert abs(places[-1].heading_rad) == pytest.approx(math.pi)
    law.update(own, goal, 0.1, neighbours={"leader": leader})
    assert law.setpoint(goal).position_table_m == pytest.approx((0.8, 0.0))
    law.reset()
    law.update(own, goal, 0.1)
    assert law.setpoint(goal).position_table_m == pytest.approx((0.8, 0.0))  # it knows of no leader
