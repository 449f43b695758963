"""One vehicle's supervisor among what it sees: take-off and faults, period by period."""

from unit.groundstation.supervision.machines import rules

from groundstation.supervision.modes import Event, Law, Mode

S = 1_000_000_000


class TestTakeOff:
    def test_where_flight_is_wanted_it_takes_off_once_every_check_passes(self, vehicle):
        vehicle.sightings.rest_s = 3.0
        assert vehicle.run(1.0) == ["resting"]
        assert vehicle.ruling.waits_for == ("rest: unbroken rest of 3.0 s, 8 s are asked for",)
        assert rules(vehicle) == (Law.CLOSED, False, False)
        vehicle.sightings.rest_s = 8.0
        assert vehicle.run(1.0) == ["armed", "flying"]
        assert rules(vehicle) == (Law.CONTROLLER, True, True)
        assert vehicle.ruling.waits_for == ()
        assert vehicle.ruling.memory.cause == "the float air carries it"

    def test_it_is_armed_with_closed_valves_until_the_air_carries_it(self, vehicle):
        vehicle.step()
        assert rules(vehicle) == (Law.CLOSED, True, True)
        assert vehicle.run(0.3) == ["armed"]  # the air is reported from the next period on
        assert vehicle.run(0.02) == ["flying"]

    def test_air_that_does_not_come_leaves_it_armed(self, vehicle):
        vehicle.air_obeys = False
        assert vehicle.run(5.0) == ["armed"]
        assert vehicle.ruling.is_air_on

    def test_where_flight_is_not_wanted_it_stays_landed(self, landed):
        assert landed.run(5.0) == ["landed"]
        assert rules(landed) == (Law.CLOSED, False, False)
        assert landed.ruling.waits_for == ()

    def test_a_person_lets_it_fly(self, landed):
        assert landed.ask(Event.FLY) == ""
        assert landed.run(1.0) == ["armed", "flying"]

    def test_a_person_arms_and_floats_it_step_by_step(self, landed):
        assert landed.ask(Event.ARM) == ""
        assert landed.run(1.0) == ["armed"]
        assert rules(landed) == (Law.CLOSED, True, False)
        assert landed.ask(Event.FLOAT_ON) == ""
        assert landed.run(1.0) == ["armed", "flying"]

    def test_an_unarmed_vehicle_floats_by_request(self, landed):
        assert landed.ask(Event.FLOAT_ON) == ""
        assert landed.run(1.0) == ["floating"]
        assert rules(landed) == (Law.CLOSED, False, True)

    def test_a_float_order_that_is_still_on_its_way_is_no_landing(self, landed):
        landed.air_obeys = False
        landed.ask(Event.FLOAT_ON)
        assert landed.run(1.0) == ["floating"]
        landed.floating = True
        landed.run(0.1)
        landed.floating = False
        assert landed.run(0.1) == ["landing", "landed"]

    def test_arming_is_gated_and_an_override_needs_a_reason(self, landed):
        landed.sightings.rest_s = 3.0
        assert landed.ask(Event.ARM) == "rest: unbroken rest of 3.0 s, 8 s are asked for"
        assert landed.ask(Event.ARM, "on foam") == ""
        assert landed.ruling.memory.cause == "armed by request: override: on foam"

    def test_an_override_of_a_flight_lasts_until_the_next_one(self, landed):
        landed.sightings.rest_s = 3.0
        landed.ask(Event.FLY, "on foam")
        assert landed.run(1.0) == ["armed", "flying"]
        landed.ask(Event.LAND)
        landed.run(0.1)
        landed.ask(Event.FLY)
        assert landed.run(1.0) == ["resting"]

    def test_a_refused_flight_overrides_nothing(self, landed):
        landed.sightings.rest_s = 3.0
        landed.press(1)
        assert landed.ask(Event.FLY, "on foam")
        landed.ask(Event.RELEASE)
        landed.ask(Event.FLY)
        assert landed.run(1.0) == ["resting"]

    def test_a_release_ends_an_override(self, vehicle):
        vehicle.sightings.rest_s = 3.0
        vehicle.ask(Event.FLY, "on foam")
        vehicle.ask(Event.RELEASE)
        vehicle.ask(Event.FLY)
        assert vehicle.run(1.0) == ["resting"]

    def test_it_waits_for_nothing_once_flight_is_not_wanted(self, vehicle):
        vehicle.sightings.rest_s = 3.0
        vehicle.run(0.1)
        vehicle.ask(Event.LAND)
        vehicle.run(0.1)
        assert vehicle.ruling.waits_for == ()

    def test_requests_of_a_person_are_remembered_with_their_author(self, flying):
        flying.ask(Event.BRAKE)
        memory = flying.ruling.memory
        assert (memory.author, memory.cause, memory.since_ns) == ("anna", "brakes by request", flying.now_ns)


class TestNode:
    def test_air_that_goes_off_in_flight_lands_it(self, flying):
        flying.air_obeys, flying.floating = False, False
        flying.step()
        assert flying.mode is Mode.LANDING
        assert rules(flying) == (Law.CLOSED, False, False)

    def test_a_silent_node_is_lost_and_lands_when_it_is_back(self, flying):
        flying.silent.add("node")
        assert flying.run(1.0) == ["flying", "lost"]
        assert rules(flying) == (Law.CLOSED, False, False)
        flying.silent.clear()
        flying.sightings.rest_s = 0.0
        assert flying.run(1.0) == ["resting"]

    def test_a_node_that_is_back_on_air_is_landed(self, flying):
        flying.silent.add("node")
        flying.air_obeys = False
        flying.run(1.0)
        flying.silent.clear()
        assert flying.run(0.1) == ["landing"]
        assert not flying.ruling.is_air_on

    def test_a_node_that_never_reported_keeps_it_down(self, vehicle):
        vehicle.silent.add("node")
        assert vehicle.run(0.2) == ["resting"]
        assert vehicle.ruling.waits_for == ("heartbeats: nothing comes from valve node",)

    def test_how_long_the_air_is_on_counts_anew_after_it_was_off(self, vehicle):
        vehicle.fly()
        vehicle.ask(Event.LAND)
        vehicle.run(0.1)
        vehicle.ask(Event.FLY)
        vehicle.step()
        assert vehicle.mode is Mode.ARMED
        assert vehicle.run(0.3) == ["armed"]
        assert vehicle.run(0.02) == ["flying"]


class TestFaults:
    def test_a_look_says_whether_a_fault_began_or_ended(self, flying):
        assert not flying.step()
        flying.findings = {"camera_torn": "rows"}
        assert flying.step()
        assert not flying.step()
        flying.findings = {}
        changes = [flying.step() for _ in range(60)]
        assert changes.count(True) == 1
        assert flying.mode is Mode.FLYING

    def test_a_passing_fault_brakes_and_flies_on(self, flying):
        flying.status = "flying"
        flying.silent.add("demand")
        flying.velocity = (0.05, 0.0)
        assert flying.run(1.0) == ["flying", "braking"]
        assert rules(flying) == (Law.BRAKE, True, True)
        assert flying.ruling.memory.cause.startswith("brakes for a fault: controller_silent (the newest")
        flying.velocity = (0.0, 0.0)
        assert flying.run(1.0) == ["holding"]
        flying.silent.clear()
        assert flying.run(1.5) == ["holding", "flying"]
        assert flying.ruling.memory.cause == "the fault is gone"

    def test_what_landed_it_is_gone_before_it_arms_again(self, flying):
        flying.status = "flying"
        flying.silent.add("demand")
        assert flying.run(5.0)[-1] == "holding"
        modes = flying.run(4.0)
        assert modes == ["holding", "landing", "resting"]
        assert flying.run(60.0) == ["resting"], "it does not take off and land in turns"
        assert any("controller" in reason for reason in flying.ruling.waits_for)
        flying.silent.clear()
        assert flying.run(2.5) == ["resting", "armed", "flying"]

    def test_what_a_person_brakes_is_not_let_go_by_a_fault_that_ends(self, flying):
        flying.ask(Event.BRAKE)
        flying.findings = {"camera_torn": ""}
        flying.run(0.5)
        flying.findings = {}
        assert flying.run(3.0) == ["holding"]

    def test_a_fault_that_lands_brakes_holds_and_lands(self, flying):
        flying.findings = {"camera_frozen": "9000 frames/s"}
        flying.velocity = (0.05, 0.0)
        assert flying.run(1.0) == ["braking"]
        flying.velocity = (0.0, 0.0)
        assert flying.run(2.0) == ["holding"]
        assert flying.run(0.2) == ["landing", "resting"]
        assert flying.ruling.memory.cause.endswith("camera_frozen (9000 frames/s)")
        assert flying.run(20.0) == ["resting"]
        assert flying.ruling.waits_for == ("faults: camera_frozen (9000 frames/s)",)

    def test_a_fault_that_lands_makes_it_land_even_if_it_goes(self, flying):
        flying.findings = {"camera_frozen": ""}
        flying.step()
        flying.findings, flying.sightings.rest_s = {}, 0.0
        assert flying.run(3.0) == ["holding", "landing", "resting"]

    def test_a_landing_fault_that_comes_later_lands_what_holds(self, flying):
        flying.ask(Event.BRAKE)
        flying.run(0.5)
        assert flying.mode is Mode.HOLDING
        flying.findings = {"camera_frozen": ""}
        assert flying.run(0.02) == ["holding"]
        assert flying.run(3.0) == ["holding", "landing", "resting"]

    def test_braking_without_end_is_not_begun_again_by_its_own_fault(self, flying):
        flying.findings = {"camera_frozen": ""}
        flying.velocity = (0.05, 0.0)
        assert flying.run(10.0) == ["braking"]
        assert flying.run(0.1) == ["landing", "resting"]

    def test_a_fault_that_a_person_must_clear_keeps_it_down(self, flying):
        flying.findings = {"valve_stuck_open": "valve 3"}
        flying.run(5.0)
        flying.findings = {}
        assert flying.run(5.0) == ["landed"]
        assert flying.faults == ["valve_stuck_open"]
        assert flying.ask(Event.ARM) == "faults: valve_stuck_open (valve 3)"
        assert flying.ask(Event.RELEASE) == ""
        assert flying.faults == []
        assert flying.ask(Event.FLY) == ""
        assert flying.run(1.0) == ["armed", "flying"]

    def test_to_fly_clears_what_is_gone_as_well(self, flying):
        flying.findings = {"valve_stuck_open": ""}
        flying.run(5.0)
        flying.findings = {}
        flying.run(2.0)
        assert flying.ask(Event.FLY) == ""
        assert flying.faults == []

    def test_other_requests_clear_nothing(self, flying):
        flying.findings = {"valve_stuck_open": ""}
        flying.run(5.0)
        flying.findings = {}
        flying.run(2.0)
        flying.ask(Event.LAND)
        assert flying.faults == ["valve_stuck_open"]

    def test_flight_is_wanted_again_after_a_fault_that_clears_by_itself(self, flying):
        flying.findings = {"camera_frozen": ""}
        flying.run(5.0)
        flying.findings = {}
        assert flying.run(3.0) == ["resting", "armed", "flying"]

    def test_the_worst_fault_cuts_the_air(self, flying):
        flying.position, flying.velocity = (1.79, 0.0), (0.1, 0.0)
        flying.step()
        assert flying.mode is Mode.LANDING
        assert flying.ruling.memory.cause.startswith(
            "braking does not help: the air is cut: edge_unavoidable"
        )
        flying.velocity = (0.0, 0.0)
        assert flying.run(3.0) == ["landed"]

    def test_a_lost_estimator_holds_for_a_second_and_then_cuts(self, flying):
        flying.status = "lost"
        flying.velocity = (0.05, 0.0)
        assert flying.run(1.0) == ["braking"]
        assert flying.run(0.1) == ["landing", "resting"]

    def test_faults_without_details_are_named_alone(self, flying):
        flying.findings = {"camera_frozen": ""}
        flying.step()
        assert flying.ruling.memory.cause == "brakes for a fault, then lands: camera_frozen"

    def test_a_state_that_is_silent_is_not_at_rest(self, flying):
        flying.silent.add("state")
        flying.run(0.4)
        assert flying.mode is Mode.BRAKING
        assert flying.run(0.5) == ["braking"]

    def test_a_fault_while_armed_lands(self, vehicle):
        vehicle.step()
        assert vehicle.mode is Mode.ARMED
        vehicle.findings = {"camera_frozen": ""}
        vehicle.step()
        assert vehicle.mode is Mode.LANDING

    def test_motion_is_looked_at_while_it_floats_and_not_on_the_ground(self, landed):
        landed.sigma = (1.0, 1.0, 1.0)
        landed.run(0.5)
        assert landed.faults == []
        landed.ask(Event.FLOAT_ON)
        landed.run(0.04)
        assert landed.faults == ["position_uncertain"]

    def test_a_dead_controller_is_missed_before_anybody_takes_off(self, landed):
        landed.silent.add("demand")
        landed.ask(Event.FLOAT_ON)
        landed.run(2.0)
        assert landed.faults == ["controller_silent"]
        assert "controller_silent" in landed.ask(Event.ARM)

    def test_processes_that_start_slowly_are_no_fault_on_the_ground(self, landed):
        landed.silent.add("detector")
        landed.run(5.0)
        assert landed.faults == []
        landed.run(5.0)
        assert landed.faults == ["detector_silent"]

    def test_a_late_look_is_counted_against_the_period(self, flying):
        flying.now_ns += 90_000_000
        flying.step()
        assert flying.faults == []
        flying.now_ns += 110_000_000
        flying.step()
        assert flying.faults == ["cpu_starved"]
