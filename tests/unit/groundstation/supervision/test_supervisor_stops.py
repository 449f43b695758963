"""One vehicle's supervisor among what it sees: stops and restarts, period by period."""

import math

import pytest
from unit.groundstation.supervision.machines import rules

from groundstation.supervision.mode_machine import GRACE_S, Memory, Then
from groundstation.supervision.modes import Event, Law, Mode

S = 1_000_000_000


class TestStop:
    def test_a_stop_brakes_holds_lands_and_is_latched(self, flying):
        flying.velocity = (0.05, 0.0)
        assert flying.ruling.grace_s == math.inf
        assert flying.press(1)
        assert rules(flying) == (Law.BRAKE, True, True)
        assert flying.ruling.grace_s == GRACE_S
        assert flying.run(1.0) == ["braking"]
        flying.velocity = (0.0, 0.0)
        assert flying.run(2.0) == ["holding"]
        assert flying.ruling.grace_s == GRACE_S
        assert flying.run(0.1) == ["landing", "stopped"]
        assert rules(flying) == (Law.CLOSED, False, False)
        assert flying.ruling.grace_s == 0.0
        assert flying.run(20.0) == ["stopped"]
        memory = flying.ruling.memory
        assert (memory.cause, memory.author, memory.is_stop_latched) == (
            "stopped: brakes, holds, lands", "anna", True,
        )  # fmt: skip

    def test_a_repeated_press_is_none(self, flying):
        flying.press(1)
        flying.run(1.0)
        assert not flying.press(1)
        assert flying.press(2)
        assert flying.mode is Mode.LANDING

    @pytest.mark.parametrize(
        ("found", "cause"),
        [
            ({"status": "lost"}, "fusion_lost"),
            ({"position": (1.79, 0.0), "velocity": (0.1, 0.0)}, "edge_unavoidable"),
        ],
    )
    def test_a_stop_that_cannot_brake_cuts_the_air_at_once(self, flying, seen, found, cause):
        flying.sightings.own = seen(flying.now_ns, **found)
        assert flying.press(1)
        assert flying.mode is Mode.LANDING
        assert flying.ruling.memory.cause == f"braking does not help: the air is cut: {cause}"

    def test_a_stop_without_a_state_cuts_the_air_at_once(self, flying):
        flying.now_ns += 350_000_000
        assert flying.press(1)
        assert flying.ruling.memory.cause == "braking does not help: the air is cut: state_silent"

    def test_a_stop_without_a_node_cuts_the_air_at_once(self, flying, seen):
        flying.now_ns += 550_000_000
        flying.sightings.own = seen(flying.now_ns)
        assert flying.press(1)
        assert flying.ruling.memory.cause == "braking does not help: the air is cut: can_silent"

    def test_a_stop_beside_another_vehicle_cuts_the_air_at_once(self, flying, seen):
        flying.sightings.own = seen(flying.now_ns, velocity=(0.1, 0.0))
        flying.sightings.others["beta"] = seen(flying.now_ns, (0.35, 0.0))
        assert flying.press(1)
        assert flying.ruling.memory.cause == "braking does not help: the air is cut: vehicle_unavoidable"

    def test_a_stop_with_room_brakes_whatever_else_is_wrong(self, flying):
        flying.sightings.findings = {"camera_frozen": ""}
        assert flying.press(1)
        assert flying.mode is Mode.BRAKING

    def test_a_stop_on_the_ground_is_latched_and_only_a_release_ends_it(self, landed):
        assert landed.press(1)
        assert landed.mode is Mode.STOPPED
        assert landed.ask(Event.FLY) == "a stop is latched by anna: release it first"
        assert landed.run(3.0) == ["stopped"]
        assert landed.ask(Event.RELEASE) == ""
        assert landed.run(1.0) == ["landed"]
        assert landed.ruling.grace_s == math.inf

    @pytest.mark.parametrize("landing", [Event.LAND, Event.DISARM, Event.FLOAT_OFF])
    def test_what_a_person_lands_stays_down(self, flying, landing):
        assert flying.ask(landing) == ""
        assert not flying.ruling.is_air_on
        assert flying.run(20.0) == ["landed"]
        assert flying.ask(Event.FLY) == ""
        assert flying.run(1.0) == ["armed", "flying"]


class TestRestart:
    def memory(self, mode, then=Then.FLY, *, latched=False):
        return Memory(mode, latched, True, then, "why", "anna", 0)

    def test_a_vehicle_in_flight_brakes_and_says_so_once(self, vehicle):
        vehicle.sightings.own = None
        vehicle.floating = True
        vehicle.supervisor.recall(self.memory(Mode.FLYING), 0)
        assert vehicle.mode is Mode.BRAKING
        assert vehicle.run(0.5) == ["holding"]
        assert vehicle.faults == ["commands_restarted"]
        assert [row.detail for row in vehicle.supervisor.board] == ["it was flying"]
        assert vehicle.run(1.0) == ["holding", "flying"]
        assert vehicle.faults == []

    def test_a_vehicle_on_the_ground_says_nothing(self, vehicle):
        vehicle.supervisor.recall(self.memory(Mode.STOPPED, latched=True), 0)
        assert vehicle.run(3.0) == ["stopped"]
        assert vehicle.faults == []
        assert vehicle.ruling.grace_s == 0.0

    def test_a_stop_in_flight_lands_after_a_restart_and_stays_stopped(self, vehicle):
        vehicle.floating = True
        vehicle.supervisor.recall(self.memory(Mode.BRAKING, Then.LAND, latched=True), 0)
        assert not vehicle.ruling.is_air_on
        assert vehicle.run(3.0) == ["stopped"]
        memory = vehicle.ruling.memory
        assert (memory.is_stop_latched, memory.author) == (True, "anna")
