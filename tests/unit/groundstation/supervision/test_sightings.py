"""What is known of a vehicle at a moment, and which faults that is. Limits are tried from both sides."""

import math

import pytest

from groundstation.control.corridor import Corridor, Docking
from groundstation.supervision.seen_faults import ONLY_ALOFT, faults_seen

MS = 1_000_000
S = 1000 * MS
NAN = math.nan


@pytest.fixture
def known(sightings, seen, node):
    """Everything is well at 20 s: all that publishes has published just now."""
    now_ns = 20 * S
    known = sightings(findings_ns=now_ns, demand_ns=now_ns, rest_s=8.0, fix_age_s=0.3)
    known.see_own(seen(now_ns))
    known.node = node(now_ns, armed=True, floating=True)
    return known


def found(known, now_ns=20 * S, *, is_grounded=False, is_aloft=True, may_open=True):
    return faults_seen(known, now_ns, is_grounded=is_grounded, is_aloft=is_aloft, may_open=may_open)


def test_where_all_is_well_nothing_is_found(known):
    assert found(known) == {}
    assert found(known, is_grounded=True, is_aloft=False, may_open=False) == {}


class TestSilence:
    @pytest.mark.parametrize(
        ("fault", "limit_ms", "detail"),
        [
            ("state_silent", 300, "the newest state is 0.3 s old"),
            ("can_silent", 500, "the newest status is 0.5 s old"),
            ("detector_silent", 1000, "the newest findings is 1.0 s old"),
            ("controller_silent", 500, "the newest demand is 0.5 s old"),
        ],
    )
    def test_each_source_has_its_limit(self, known, seen, node, fault, limit_ms, detail):
        def at(now_ns):
            for name, kept in (
                ("state_silent", lambda: known.see_own(seen(now_ns))),
                ("can_silent", lambda: setattr(known, "node", node(now_ns, armed=True, floating=True))),
                ("detector_silent", lambda: setattr(known, "findings_ns", now_ns)),
                ("controller_silent", lambda: setattr(known, "demand_ns", now_ns)),
            ):
                if name != fault:
                    kept()
            return found(known, now_ns)

        assert at(20 * S + limit_ms * MS) == {}
        assert at(20 * S + limit_ms * MS + 1) == {fault: detail}

    def test_before_the_first_arrival_silence_counts_from_the_beginning(self, sightings):
        known = sightings(began_ns=5 * S)
        assert found(known, 5 * S + 300 * MS) == {}
        assert found(known, 5 * S + 300 * MS + 1) == {"state_silent": "no state was ever received"}
        assert found(known, 5 * S + 500 * MS + 1)["can_silent"] == "no status was ever received"
        assert found(known, 6 * S + 1)["detector_silent"] == "no findings was ever received"

    def test_on_the_ground_processes_may_take_ten_seconds_to_start(self, sightings):
        known = sightings(began_ns=5 * S)
        assert found(known, 15 * S, is_grounded=True, is_aloft=False) == {}
        late = found(known, 15 * S + 1, is_grounded=True, is_aloft=False)
        assert set(late) == {"can_silent", "detector_silent"}  # fusion may be waiting for its first fix

    def test_on_the_ground_a_state_that_was_there_is_missed(self, known):
        assert "state_silent" in found(known, 21 * S, is_grounded=True, is_aloft=False)

    def test_without_a_state_no_controller_is_missed(self, known):
        known.demand_ns = None
        known.own = None
        assert "controller_silent" not in found(known, 21 * S)

    @pytest.mark.parametrize("is_grounded", [True, False])
    def test_a_controller_that_never_demanded_anything_is_missed_once_there_is_a_state(
        self, known, is_grounded
    ):
        known.demand_ns, known.placed_ns = None, 20 * S - 500 * MS
        assert found(known, is_grounded=is_grounded) == {}
        known.placed_ns -= 1
        assert found(known, is_grounded=is_grounded) == {"controller_silent": "no demand was ever received"}

    def test_a_controller_waits_for_the_first_placed_state_without_a_break(self, known, seen):
        known.demand_ns = 18 * S
        known.placed_ns = 18 * S
        assert "controller_silent" in found(known)
        known.see_own(seen(20 * S, status="resting"))
        assert found(known) == {}
        known.see_own(seen(20 * S))
        assert found(known) == {}

    def test_a_program_outside_is_missed_where_valves_may_open(self, known):
        known.outside_trouble = "anna: no wrench for 250 ms"
        assert found(known) == {"outside_silent": "anna: no wrench for 250 ms"}
        assert found(known, may_open=False) == {}

    def test_a_recorder_is_missed_only_where_there_was_one(self, known):
        assert found(known) == {}
        known.recorder_ns = 18 * S
        assert found(known) == {}
        known.recorder_ns = 18 * S - 1
        assert found(known) == {"recorder_down": "the newest status is 2.0 s old"}

    def test_a_disk_that_is_nearly_full_is_low(self, known):
        known.recorder_ns, known.recorder_room_s = 20 * S, 60.0
        assert found(known) == {}
        known.recorder_room_s = 59.4
        assert found(known) == {"disk_low": "room for 59 s"}
        known.recorder_ns = 0
        assert set(found(known)) == {"recorder_down"}

    @pytest.mark.parametrize("is_grounded", [True, False])
    def test_what_the_recorder_has_lost_is_named_at_once(self, known, is_grounded):
        known.began_ns = known.recorder_ns = 20 * S
        known.recorder_trouble = "run.mcap.part was deleted"
        assert found(known, is_grounded=is_grounded)["recording_lost"] == "run.mcap.part was deleted"

    def test_a_disk_that_is_full_and_a_recorder_that_is_silent_are_not_named_twice(self, known):
        known.recorder_ns, known.recorder_trouble, known.recorder_room_s = 20 * S, "it is full", 0.0
        assert set(found(known)) == {"disk_low"}
        known.recorder_room_s, known.recorder_ns = 1e6, 0
        assert set(found(known)) == {"recorder_down"}

    def test_states_of_leaders_may_be_a_second_old(self, known, seen):
        known.neighbours = ("beta", "gamma", "delta")
        known.others = {"beta": seen(19 * S), "delta": seen(0), "other": seen(0)}
        assert found(known) == {"leader_old": "delta: the newest state is 20.0 s old"}
        known.others = {"beta": seen(19 * S), "other": seen(0)}
        assert found(known) == {}
        known.others = {"beta": seen(19 * S - 1)}
        assert found(known) == {"leader_old": "beta: the newest state is 1.0 s old"}

    def test_a_leader_that_is_seen_counts_by_its_sightings(self, known, seen):
        known.neighbours, known.seen_leader = ("beta",), "beta"
        known.others = {"beta": seen(0)}
        assert found(known) == {}  # the vehicle does not know its own place
        known.placed_ns = 19 * S
        assert found(known) == {}
        known.placed_ns = 10 * S
        assert found(known) == {"leader_old": "beta is not seen: the newest sighting is 10.0 s old"}
        known.leader_seen_ns = 19 * S
        assert found(known) == {}

    def test_others_count_for_a_second(self, known, seen):
        known.others = {"beta": seen(19 * S), "gamma": seen(19 * S - 1)}
        assert set(known.others_here(20 * S)) == {"beta"}


class TestMoments:
    def look(self, known, *stamps_ms, period_ms=20):
        for stamp_ms in stamps_ms:
            known.look(stamp_ms * MS, period_ms * MS)
        return {fault: text for fault, text in found(known).items() if "cpu" in fault or "clock" in fault}

    @pytest.mark.parametrize(
        ("pause_ms", "expected"),
        [
            (20, {}),
            (120, {}),
            (121, {"cpu_starved": "looked 101 ms late"}),
            (1020, {"cpu_starved": "looked 1000 ms late"}),
            (1040, {"clock_jumped": "by +1.02 s"}),
            (-480, {}),
            (-481, {"clock_jumped": "by -0.50 s"}),
        ],
    )
    def test_a_look_that_is_late_or_early_is_found(self, known, pause_ms, expected):
        assert self.look(known, 1000, 1000 + pause_ms) == expected

    def test_the_first_look_is_never_late_and_the_next_one_in_time_is_well(self, known):
        assert self.look(known, 5000) == {}
        assert self.look(known, 5500)
        assert self.look(known, 5520) == {}


class TestSupplies:
    def test_a_tank_is_low_below_thirty_bar(self, known, node):
        known.node = node(20 * S, armed=True, floating=True, pressure_pa=30e5)
        assert found(known) == {}
        known.node = node(20 * S, armed=True, floating=True, pressure_pa=29.6e5)
        assert found(known) == {"tank_low": "30 bar"}
        known.node = node(20 * S, armed=True, floating=True, pressure_pa=NAN)
        assert found(known) == {}

    @pytest.mark.parametrize(("bits", "is_low"), [(0, False), (1, True), (3, True), (2, False)])
    def test_undervoltage_is_the_lowest_fault_bit(self, known, node, bits, is_low):
        known.node = node(20 * S, armed=True, floating=True, faults=bits)
        expected = {"battery_low": "the valve node reports undervoltage"}
        assert found(known) == (expected if is_low else {})

    @pytest.mark.parametrize(("bits", "is_reported"), [(0, False), (127, False), (128, True), (129, True)])
    def test_a_coil_that_the_node_reports_is_the_highest_fault_bit(self, known, node, bits, is_reported):
        known.node = node(20 * S, armed=True, floating=True, faults=bits)
        detail = found(known).get("coil_fault")
        assert detail == ("the valve node reports an open or shorted coil" if is_reported else None)

    def test_of_a_node_that_never_reported_nothing_is_known(self, known):
        known.node = None
        assert set(found(known)) == {"can_silent"}


class TestMotion:
    def fly(self, known, seen, x_m, speed_m_s=0.1, status="flying", **where):
        known.own = seen(20 * S, (x_m, 0.0), (speed_m_s, 0.0), status=status)
        return found(known, **where)

    # the edge is at 1.8 m; 0.1 m/s: 0.015 m of reaction and 0.01 / 0.1 = 0.1 m of braking
    @pytest.mark.parametrize(
        ("x_m", "expected"),
        [
            (1.634, {}),
            (1.636, {"edge_ahead": "it would stop 49 mm before it"}),
            (1.734, {"edge_ahead": "it would stop -49 mm before it"}),
            (1.737, {"edge_unavoidable": "it would stop 52 mm beyond"}),
        ],
    )
    def test_the_edge_is_seen_in_time(self, known, seen, x_m, expected):
        assert self.fly(known, seen, x_m) == expected

    # disarmed, 0.1 m/s: 0.05 m until it has sunk and 0.01 / 2 = 0.005 m of sliding, 0.01 m to be left
    @pytest.mark.parametrize(
        ("x_m", "detail"),
        [
            (1.734, None),
            (1.736, "disarmed it does not brake: landed now, 9 mm would be left"),
            (1.75, "disarmed it does not brake: landed now, it would not stop in time"),
        ],
    )
    def test_disarmed_it_does_not_wait_for_a_brake_that_it_has_not(self, known, seen, x_m, detail):
        assert self.fly(known, seen, x_m, may_open=False).get("edge_unavoidable") == detail
        assert self.fly(known, seen, x_m, -0.1, may_open=False) == {}  # it goes away

    @pytest.mark.parametrize("apart_m", [0.366, 0.364])
    def test_disarmed_it_lands_before_another_vehicle(self, known, seen, apart_m):
        known.others = {"beta": seen(20 * S, (apart_m, 0.0))}
        expected = {"vehicle_unavoidable"} if apart_m < 0.365 else set()
        assert set(self.fly(known, seen, 0.0, may_open=False)) == expected

    @pytest.mark.parametrize("status", ["resting", "lost"])
    def test_disarmed_and_unplaced_no_edge_is_looked_for(self, known, seen, status):
        assert "edge_unavoidable" not in self.fly(known, seen, 1.79, status=status, may_open=False)

    def test_on_the_ground_or_unplaced_no_edge_is_looked_for(self, known, seen):
        assert self.fly(known, seen, 1.7, is_aloft=False) == {}
        assert self.fly(known, seen, 1.7, status="resting") == {}

    def test_a_state_that_is_too_old_says_nothing_about_edges(self, known, seen):
        known.own = seen(19 * S, (1.7, 0.0), (0.1, 0.0))
        assert set(found(known)) == {"state_silent"}

    # bodies take 0.3 m, the way 0.115 m
    @pytest.mark.parametrize(
        ("apart_m", "expected"),
        [
            (0.446, {}),
            (0.444, {"vehicle_ahead": "beta: 29 mm would be left"}),
            (0.416, {"vehicle_ahead": "beta: 1 mm would be left"}),
            (0.405, {"vehicle_unavoidable": "beta: they would overlap by 10 mm"}),
        ],
    )
    def test_another_vehicle_is_seen_in_time(self, known, seen, apart_m, expected):
        known.others = {"beta": seen(20 * S, (apart_m, 0.0))}
        assert self.fly(known, seen, 0.0) == expected

    def test_who_docks_is_braked_for_outside_its_corridor_only(self, known, seen):
        # 0.02 m/s at 0.31 m between centres, 0.3 m of bodies: they could not stop before they touch
        corridor = Corridor(math.pi, 0.26, 0.4, 0.3, 0.015, 0.03, 0.02, 0.002)
        known.name = "alpha"
        known.dockings = (Docking("alpha", "beta", corridor),)
        known.others = {"beta": seen(20 * S, (0.31, 0.0), (0.0, 0.0))}
        assert self.fly(known, seen, 0.0, 0.02) == {}
        assert set(self.fly(known, seen, 0.0, 0.1)) == {"vehicle_unavoidable"}  # too fast for the corridor
        known.others = {"beta": seen(20 * S, (0.31, 0.03), (0.0, 0.0))}
        assert set(self.fly(known, seen, 0.0, 0.02)) == {"vehicle_ahead"}  # beside the axis
        known.others = {"gamma": seen(20 * S, (0.31, 0.0), (0.0, 0.0))}
        assert set(self.fly(known, seen, 0.0, 0.02)) == {"vehicle_ahead"}  # another one

    def test_another_vehicle_that_was_not_seen_for_long_is_not_braked_for(self, known, seen):
        known.others = {"beta": seen(18 * S, (0.4, 0.0))}
        assert self.fly(known, seen, 0.0) == {}


class TestEstimate:
    @pytest.mark.parametrize(
        ("sigma", "is_found"),
        [
            ((0.05, 0.05, math.radians(5.0)), False),
            ((0.0501, 0.0, 0.0), True),
            ((0.0, 0.0501, 0.0), True),
            ((0.0, 0.0, math.radians(5.01)), True),
            ((0.0, 0.0, 0.06), False),
        ],
    )
    def test_an_uncertain_position_is_found(self, known, seen, sigma, is_found):
        known.own = seen(20 * S, sigma=sigma)
        assert ("position_uncertain" in found(known)) is is_found
        assert found(known, is_aloft=False) == {}

    def test_how_uncertain_it_is_is_said(self, known, seen):
        known.own = seen(20 * S, sigma=(0.06, 0.02, math.radians(3.0)))
        assert found(known) == {"position_uncertain": "sigma 60 mm, 20 mm, 3.0 deg"}

    def test_an_estimator_that_is_lost_is_more_than_uncertain(self, known, seen):
        known.own = seen(20 * S, status="lost", sigma=(1.0, 1.0, 1.0))
        assert found(known) == {"fusion_lost": "the estimator reports it"}


class TestObedience:
    def test_a_node_that_floats_disarmed_disobeys(self, known, node):
        known.node = node(20 * S, armed=False, floating=True)
        assert found(known) == {"node_disobeys": "it reports that it is disarmed"}
        assert found(known, may_open=False) == {}

    def test_a_node_that_does_not_float_yet_may_still_be_disarmed(self, known, node):
        known.node = node(20 * S, armed=False, floating=False)
        assert found(known) == {}

    def test_a_dead_man_that_closed_the_valves_is_found(self, known, node):
        known.node = node(20 * S, armed=True, floating=True, dead_man=True)
        assert found(known) == {"node_disobeys": "its dead man has closed the valves"}

    def test_of_a_silent_node_only_its_silence_is_known(self, known, node):
        known.node = node(19 * S, armed=False, floating=True)
        assert set(found(known)) == {"can_silent"}


def test_what_only_motion_shows_means_nothing_on_the_ground(known):
    known.findings = dict.fromkeys([*ONLY_ALOFT, "imu_stuck"], "x")
    assert set(found(known)) == {*ONLY_ALOFT, "imu_stuck"}
    assert found(known, is_aloft=False) == {"imu_stuck": "x"}


class TestRest:
    @pytest.mark.parametrize(
        ("velocity", "rate_deg_s", "is_at_rest"),
        [
            ((0.0, 0.0), 0.0, True),
            ((0.0119, 0.0), 2.99, True),
            ((0.0, -0.0119), -2.99, True),
            ((0.0121, 0.0), 0.0, False),
            ((0.009, 0.009), 0.0, False),
            ((0.0, 0.0), 3.01, False),
            ((0.0, 0.0), -3.01, False),
            ((0.012, 0.0), 0.0, False),
            ((0.0, 0.0), 3.0, False),
        ],
    )
    def test_slow_is_at_rest(self, known, seen, velocity, rate_deg_s, is_at_rest):
        known.own = seen(0, velocity=velocity, rate_rad_s=math.radians(rate_deg_s))
        assert known.is_at_rest is is_at_rest

    def test_without_an_estimate_nothing_is_at_rest(self, sightings):
        assert not sightings().is_at_rest
