"""The state machine: what moves it, what is refused, what is noted, and what time does."""

from dataclasses import replace

import pytest
from unit.groundstation.supervision.machines import (
    FLYING,
    OF_MODE,
    PERSON,
    STATIONS,
    S,
    driven,
    machine,
)

from groundstation.supervision.mode_machine import (
    GRACE_S,
    HOLD_S,
    LONGEST_BRAKING_S,
    NEW_PRESS_S,
    Memory,
    ModeMachine,
    Then,
)
from groundstation.supervision.modes import (
    TRANSITIONS,
    Event,
    Mode,
)


def test_a_machine_begins_as_the_rig_says():
    by_itself = ModeMachine(7, starts_by_itself=True)
    assert by_itself.memory == Memory(Mode.RESTING, False, True, Then.FLY, "it has just begun", "", 7)
    assert not by_itself.wants_air
    waits = ModeMachine(7, starts_by_itself=False)
    assert (waits.mode, waits.then, waits.memory.is_flight_wanted) == (Mode.LANDED, Then.FLY, False)


def test_spans_fit_together():
    assert (HOLD_S, LONGEST_BRAKING_S, GRACE_S, NEW_PRESS_S) == (2.0, 10.0, 12.0, 0.5)


class TestApply:
    def test_an_event_moves_it_and_is_remembered(self):
        made = machine(Mode.FLYING)
        assert made.apply(Event.BRAKE, 5, PERSON) == ""
        assert made.memory == Memory(Mode.BRAKING, False, False, Then.HOLD, "brakes by request", PERSON, 5)

    def test_a_cause_follows_the_words_of_the_table(self):
        made = machine(Mode.FLYING)
        made.apply(Event.FAULT_LANDS, 5, cause="tank_low (20 bar)")
        assert made.memory.cause == "brakes for a fault, then lands: tank_low (20 bar)"
        assert made.memory.author == ""

    def test_what_stays_in_its_mode_goes_on_since_then(self):
        made = machine(Mode.BRAKING, since_ns=3)
        made.apply(Event.BRAKE, 5, PERSON)
        assert (made.mode, made.memory.since_ns) == (Mode.BRAKING, 3)

    @pytest.mark.parametrize(
        ("mode", "event", "after"),
        [
            (Mode.BRAKING, Event.AT_REST, Mode.HOLDING),
            (Mode.HOLDING, Event.HELD, Mode.LANDING),
            (Mode.LANDING, Event.AIR_IS_OFF, Mode.LANDED),
        ],
    )
    def test_what_carries_on_keeps_cause_and_author_and_counts_anew(self, mode, event, after):
        made = machine(mode, cause="stopped: brakes", author=PERSON)
        assert made.apply(event, 9) == ""
        assert (made.mode, made.memory.cause, made.memory.author) == (after, "stopped: brakes", PERSON)
        assert made.memory.since_ns == 9

    def test_a_cause_of_its_own_is_shown(self):
        made = machine(Mode.BRAKING, cause="stopped", author=PERSON)
        made.apply(Event.HELD, 9, cause="not at rest")
        assert (made.memory.cause, made.memory.author) == ("braked and held: not at rest", "")

    def test_air_that_goes_off_in_flight_is_the_nodes_doing(self):
        made = machine(Mode.FLYING, cause="the float air carries it")
        made.apply(Event.AIR_IS_OFF, 9)
        assert made.memory.cause == "its valve node reports that the float air is off"

    @pytest.mark.parametrize("event", STATIONS)
    def test_a_person_cannot_ask_for_what_the_station_decides(self, event):
        (before, *_) = next(row.before for row in TRANSITIONS if row.event is event)
        made = machine(before)
        assert made.apply(event, 1, PERSON) == f"{event} is for the station itself to decide"
        assert made.memory == OF_MODE[before]

    @pytest.mark.parametrize(("event", "author"), [(Event.ARM, PERSON), (Event.READY, "")])
    def test_the_arming_gate_refuses_with_every_objection(self, event, author):
        made = machine(Mode.RESTING)
        assert made.apply(event, 1, author, objections=("rest: x", "pose: y")) == "rest: x; pose: y"
        assert made.memory == OF_MODE[Mode.RESTING]
        assert made.apply(event, 1, author) == ""
        assert made.mode is Mode.ARMED

    def test_the_arming_gate_refuses_nothing_that_leads_down(self):
        for event in (Event.LAND, Event.DISARM, Event.FLOAT_OFF, Event.STOP, Event.BRAKE):
            assert machine(Mode.FLYING).apply(event, 1, PERSON, objections=("rest: x",)) == ""


class TestRefusals:
    @pytest.mark.parametrize(
        ("mode", "event", "words"),
        [
            (
                Mode.FLYING,
                Event.ARM,
                "arm does not count while it is flying: it is armed, or on its way down",
            ),
            (Mode.LANDING, Event.FLY, "fly does not count while it is landing: it flies, or is on its way"),
            (
                Mode.FLYING,
                Event.FLOAT_ON,
                "float_on does not count while it is flying: wait until it is down",
            ),
            (Mode.LANDED, Event.BRAKE, "only a flying vehicle can brake"),
            (Mode.LANDED, Event.RESUME, "only a braking vehicle can resume"),
            (Mode.FLYING, Event.RELEASE, "release does not count while it is flying: no stop is latched"),
        ],
    )
    def test_a_refusal_says_why(self, mode, event, words):
        assert words in machine(mode).apply(event, 0, PERSON)

    def test_what_the_station_cannot_do_is_refused_without_a_hint(self):
        assert machine().apply(Event.HELD, 0) == "held does not count while it is landed"

    def test_a_latched_stop_is_named_with_its_author(self):
        made = machine(Mode.STOPPED, is_stop_latched=True, author=PERSON)
        assert made.apply(Event.FLY, 0, "ben") == "a stop is latched by anna: release it first"
        made = machine(Mode.STOPPED, is_stop_latched=True)
        assert made.apply(Event.ARM, 0, "ben") == "a stop is latched: release it first"

    def test_a_stop_is_released_on_the_ground(self):
        made = machine(Mode.BRAKING, is_stop_latched=True, then=Then.LAND)
        assert made.apply(Event.RELEASE, 0, "ben") == (
            "release does not count while it is braking: wait until it is down"
        )

    @pytest.mark.parametrize("mode", [Mode.BRAKING, Mode.HOLDING])
    def test_what_is_about_to_land_is_not_resumed(self, mode):
        made = machine(mode, then=Then.LAND)
        assert made.apply(Event.RESUME, 0, PERSON) == "it is about to land: why"
        assert made.mode is mode

    @pytest.mark.parametrize("mode", [Mode.BRAKING, Mode.HOLDING])
    @pytest.mark.parametrize("then", list(Then))
    def test_only_what_braked_for_a_passing_fault_flies_on_when_it_is_gone(self, mode, then):
        made = machine(mode, then=then)
        assert (made.apply(Event.FAULTS_GONE, 0) == "") is (then is Then.FLY)
        assert (made.mode is Mode.FLYING) is (then is Then.FLY)


class TestWhatIsNoted:
    def test_flight_is_wanted_by_fly_and_no_longer_after_what_takes_it_in_hand(self):
        assert driven(Event.FLY).memory.is_flight_wanted
        for event in (Event.FLOAT_ON, Event.ARM, Event.STOP, Event.LAND, Event.DISARM, Event.FLOAT_OFF):
            assert not driven(Event.FLY, event).memory.is_flight_wanted, event
        assert not driven(Event.FLY, Event.STOP, Event.RELEASE).memory.is_flight_wanted
        made = machine(Mode.STOPPED, is_flight_wanted=True, is_stop_latched=True)
        made.apply(Event.RELEASE, 0, PERSON)
        assert not made.memory.is_flight_wanted

    def test_air_is_wanted_where_it_takes_off_or_floats_by_request(self):
        assert driven(Event.FLY, Event.READY).wants_air
        assert driven(Event.FLOAT_ON).wants_air
        assert driven(Event.ARM, Event.FLOAT_ON).wants_air
        assert not driven(Event.ARM).wants_air

    @pytest.mark.parametrize("event", [Event.LAND, Event.DISARM, Event.FLOAT_OFF])
    def test_air_is_wanted_no_longer_after_landing_by_request(self, event):
        made = driven(Event.FLOAT_ON, event)
        assert not made.wants_air
        assert made.mode is Mode.LANDING

    @pytest.mark.parametrize("event", [Event.AIR_IS_OFF, Event.NODE_SILENT])
    def test_air_is_wanted_no_longer_where_the_node_lost_it(self, event):
        made = driven(*FLYING, event)
        assert not made.wants_air

    def test_only_a_stop_latches_and_only_a_release_ends_it(self):
        made = driven(*FLYING)
        made.apply(Event.STOP, 0, PERSON)
        assert made.memory.is_stop_latched
        assert made.then is Then.LAND
        for event in (Event.AT_REST, Event.HELD, Event.AIR_IS_OFF):
            made.apply(event, 0)
            assert made.memory.is_stop_latched
        assert made.mode is Mode.STOPPED
        made.apply(Event.RELEASE, 0, PERSON)
        assert (made.mode, made.memory.is_stop_latched) == (Mode.LANDED, False)

    def test_a_second_stop_latches_too(self):
        assert driven(Event.STOP_AGAIN).memory.is_stop_latched
        assert driven(Event.FLY, Event.STOP_AGAIN).then is Then.LAND

    def test_braking_leads_to_what_was_asked_for_most(self):
        assert driven(*FLYING, Event.FAULT_HOLDS).then is Then.FLY
        assert driven(*FLYING, Event.FAULT_HOLDS, Event.BRAKE).then is Then.HOLD
        assert driven(*FLYING, Event.FAULT_LANDS, Event.BRAKE).then is Then.LAND
        assert driven(*FLYING, Event.BRAKE, Event.FAULT_LANDS).then is Then.LAND
        assert driven(*FLYING, Event.BRAKE, Event.RESUME).then is Then.FLY

    def test_flight_begins_with_nothing_to_brake_for(self):
        made = machine(Mode.ARMED, then=Then.LAND)
        made.apply(Event.AIR_IS_ON, 0)
        assert (made.mode, made.then) == (Mode.FLYING, Then.FLY)
        made.memory = replace(made.memory, then=Then.HOLD)
        made.apply(Event.FAULT_HOLDS, 0)
        assert made.then is Then.FLY

    def test_after_landing_it_takes_off_again_only_where_flight_is_wanted(self):
        wanted = machine(Mode.LANDING, is_flight_wanted=True)
        wanted.apply(Event.AIR_IS_OFF, 0)
        assert wanted.mode is Mode.RESTING
        unwanted = machine(Mode.LANDING)
        unwanted.apply(Event.AIR_IS_OFF, 0)
        assert unwanted.mode is Mode.LANDED
        stopped = machine(Mode.LANDING, is_flight_wanted=True, is_stop_latched=True)
        stopped.apply(Event.AIR_IS_OFF, 0)
        assert stopped.mode is Mode.STOPPED

    def test_landing_by_request_of_what_stands_ends_landed_even_where_flight_was_wanted(self):
        made = machine(Mode.RESTING, is_flight_wanted=True)
        made.apply(Event.LAND, 0, PERSON)
        assert (made.mode, made.memory.is_flight_wanted) == (Mode.LANDED, False)

    def test_flight_can_be_given_up(self):
        made = driven(Event.FLY)
        made.give_up_flight()
        assert not made.memory.is_flight_wanted
        assert made.mode is Mode.RESTING


class TestTime:
    def test_braking_ends_at_rest_whatever_follows(self):
        for then in Then:
            made = machine(Mode.BRAKING, then=then)
            made.pass_time(1, is_at_rest=True)
            assert (made.mode, made.memory.since_ns) == (Mode.HOLDING, 1)

    def test_braking_that_leads_down_ends_in_any_case(self):
        made = machine(Mode.BRAKING, then=Then.LAND, since_ns=S)
        made.pass_time(11 * S - 1, is_at_rest=False)
        assert made.mode is Mode.BRAKING
        made.pass_time(11 * S, is_at_rest=False)
        assert made.mode is Mode.LANDING
        assert made.memory.cause == "braked and held: not at rest after 10 s"

    @pytest.mark.parametrize("then", [Then.FLY, Then.HOLD])
    def test_other_braking_goes_on(self, then):
        made = machine(Mode.BRAKING, then=then)
        made.pass_time(100 * S, is_at_rest=False)
        assert made.mode is Mode.BRAKING

    def test_holding_that_leads_down_lasts_two_seconds(self):
        made = machine(Mode.HOLDING, then=Then.LAND, since_ns=S)
        made.pass_time(3 * S - 1, is_at_rest=True)
        assert made.mode is Mode.HOLDING
        made.pass_time(3 * S, is_at_rest=False)
        assert (made.mode, made.memory.cause) == (Mode.LANDING, "why")

    @pytest.mark.parametrize("then", [Then.FLY, Then.HOLD])
    def test_other_holding_goes_on(self, then):
        made = machine(Mode.HOLDING, then=then)
        made.pass_time(100 * S, is_at_rest=True)
        assert made.mode is Mode.HOLDING

    @pytest.mark.parametrize("mode", sorted(set(Mode) - {Mode.BRAKING, Mode.HOLDING}))
    def test_time_alone_moves_nothing_else(self, mode):
        made = machine(mode, then=Then.LAND)
        made.pass_time(100 * S, is_at_rest=True)
        assert made.memory == replace(OF_MODE[mode], then=Then.LAND)
