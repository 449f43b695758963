"""The arming gate: each check refuses by its name, and only some can be overridden."""

import pytest

from groundstation.supervision.arming import CHECKS, Question, objections
from groundstation.supervision.fault_board import Standing
from groundstation.supervision.faults import FAULTS

S = 1_000_000_000
NOW_NS = 20 * S


@pytest.fixture
def known(sightings, seen, node):
    """All is well."""
    known = sightings(findings_ns=NOW_NS, rest_s=8.0, fix_age_s=0.3, agreeing=2)
    known.own, known.node = seen(NOW_NS), node(NOW_NS)
    return known


def against(known, *faults, override=""):
    standing = tuple(Standing(FAULTS[fault], "why", 0, 0) for fault in faults)
    return objections(Question(known, standing, 8.0, NOW_NS), override)


def test_where_all_is_well_nothing_objects(known):
    assert against(known) == ()


def test_a_vehicle_of_which_nothing_is_known_stays_down(sightings):
    assert against(sightings()) == (
        "heartbeats: nothing comes from valve node, fault detector, fusion",
        "rest: unbroken rest of 0.0 s, 8 s are asked for",
        "fixes: they cannot be judged, since nothing comes from fusion",
    )


def test_a_dead_imu_is_the_reason_and_not_the_stars(known):
    known.own, known.rest_s = None, 0.0
    assert against(known, "imu_silent") == (
        "heartbeats: nothing comes from fusion, which gets no IMU samples",
        "faults: imu_silent (why)",
        "rest: unbroken rest of 0.0 s, 8 s are asked for",
        "fixes: they cannot be judged, since nothing comes from fusion",
    )


def test_a_dead_sky_is_the_reason_where_the_imu_lives(known):
    known.own = None
    assert against(known) == ("fixes: no agreeing fixes have placed it yet",)


@pytest.mark.parametrize(
    ("silent", "name"), [("own", "fusion"), ("node", "valve node"), ("findings_ns", "fault detector")]
)
def test_each_heartbeat_is_asked_for(known, silent, name):
    setattr(known, silent, None)
    known.rest_s = 0.0
    assert f"heartbeats: nothing comes from {name}" in against(known, override="test")


def test_a_controller_that_has_a_state_must_have_demanded_something(known, seen):
    known.demand_ns = None
    known.see_own(seen(NOW_NS))
    assert against(known) == ("heartbeats: nothing comes from controller",)
    known.demand_ns = NOW_NS
    assert against(known) == ()


@pytest.mark.parametrize(("age_ms", "is_old"), [(300, False), (301, True)])
def test_a_state_must_be_fresh(known, seen, age_ms, is_old):
    known.own = seen(NOW_NS - age_ms * 1_000_000)
    assert against(known) == (("heartbeats: nothing comes from fusion",) if is_old else ())


@pytest.mark.parametrize(("age_ms", "is_old"), [(500, False), (501, True)])
def test_a_status_of_the_node_must_be_fresh(known, node, age_ms, is_old):
    known.node = node(NOW_NS - age_ms * 1_000_000)
    assert against(known) == (("heartbeats: nothing comes from valve node",) if is_old else ())


def test_rest_must_be_as_long_as_asked_for_unless_overridden(known):
    known.rest_s = 7.9
    assert against(known) == ("rest: unbroken rest of 7.9 s, 8 s are asked for",)
    assert against(known, override="on foam") == ()


@pytest.mark.parametrize("status", ["starting", "resting", "lost"])
def test_fixes_must_have_placed_it(known, seen, status):
    known.own = seen(NOW_NS, status=status)
    assert against(known, override="x") == ("fixes: no agreeing fixes have placed it yet",)


def test_the_newest_fix_must_be_fresh(known):
    known.fix_age_s = 3.0
    assert against(known) == ()
    known.fix_age_s = 3.1
    assert against(known, override="x") == ("fixes: the newest fix is 3.1 s old",)


def test_two_fixes_must_agree(known):
    known.agreeing = 1
    assert against(known, override="x") == ("fixes: 1 fixes agree, 2 are asked for",)


def test_it_must_stand_on_its_part_of_the_table(known, seen):
    known.own = seen(NOW_NS, (1.8, 0.0))
    assert against(known) == ()
    known.own = seen(NOW_NS, (0.0, -1.35))
    assert against(known, override="x") == ("pose: it stands 50 mm outside its part of the table",)


def test_others_must_be_apart(known, seen):
    known.others = {
        "old": seen(NOW_NS - 2 * S),
        "far": seen(NOW_NS, (0.45, 0.0)),
        "beta": seen(NOW_NS, (0.27, 0.35)),
    }
    assert against(known, override="x") == ("apart: beta is 0.44 m away, 0.45 m are asked for",)
    known.others.pop("beta")
    assert against(known) == ()


def test_faults_keep_it_down_by_name(known):
    assert against(known, "imu_stuck", "can_silent") == ("faults: imu_stuck (why); can_silent (why)",)
    assert against(known, "imu_stuck", override="x") == ("faults: imu_stuck (why)",)


def test_lesser_faults_can_be_overridden(known):
    assert against(known, "tank_low", "imu_stuck") == (
        "faults: imu_stuck (why)",
        "lesser faults: tank_low (why)",
    )
    assert against(known, "tank_low", override="a short flight") == ()


def test_faults_that_only_count_in_flight_keep_nothing_down(known):
    assert against(known, "leader_old", "commands_restarted") == ()


def test_a_fault_that_would_land_it_again_keeps_it_down_until_it_is_gone(known):
    assert against(known, "edge_unavoidable") == ("faults: edge_unavoidable (why)",)
    late = Standing(FAULTS["controller_silent"], "why", 0, 6 * S)
    assert objections(Question(known, (late,), 8.0, 6 * S)) == ("faults: controller_silent (why)",)
    gone = Standing(FAULTS["edge_unavoidable"], "why", 0, 0, is_there=False)
    assert objections(Question(known, (gone,), 8.0, 6 * S)) == ()


def test_checks_have_names_of_their_own_and_say_what_must_hold():
    assert len({check.name for check in CHECKS}) == len(CHECKS)
    assert all(check.summary for check in CHECKS)
    assert [check.name for check in CHECKS if check.may_be_overridden] == ["lesser faults", "rest"]
