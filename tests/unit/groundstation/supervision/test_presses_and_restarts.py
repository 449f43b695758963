"""The state machine: presses of the stop, and what it is after a restart."""

from dataclasses import replace

import pytest
from unit.groundstation.supervision.machines import (
    FLYING,
    OF_MODE,
    PERSON,
    S,
    driven,
    machine,
)

from groundstation.supervision.mode_machine import (
    ModeMachine,
    Then,
)
from groundstation.supervision.modes import (
    BRAKEABLE,
    GROUNDED,
    Event,
    Mode,
)


class TestPresses:
    def test_a_first_press_stops(self):
        made = driven(*FLYING)
        assert made.press(PERSON, 1, 0)
        assert (made.mode, made.memory.author) == (Mode.BRAKING, PERSON)

    def test_repeats_of_an_id_are_one_press_for_ever(self):
        made = driven(*FLYING)
        made.press(PERSON, 1, 0)
        for now_ns in (1, S, 5 * S):
            assert not made.press(PERSON, 1, now_ns)
        assert made.mode is Mode.BRAKING

    def test_a_press_that_bounces_is_none(self):
        made = driven(*FLYING)
        made.press(PERSON, 1, 0)
        assert not made.press(PERSON, 2, S // 2 - 1)
        assert not made.press("ben", 1, S // 2 - 1)
        assert made.mode is Mode.BRAKING

    def test_a_new_press_after_half_a_second_cuts_at_once(self):
        made = driven(*FLYING)
        made.press(PERSON, 1, 0)
        assert made.press(PERSON, 2, S // 2)
        assert (made.mode, made.memory.cause) == (Mode.LANDING, "stopped twice: air cut")

    def test_presses_that_bounce_do_not_put_off_the_one_that_counts(self):
        made = driven(*FLYING)
        made.press(PERSON, 1, 0)
        assert not made.press(PERSON, 2, 4 * S // 10)
        assert made.press(PERSON, 3, 6 * S // 10)
        assert made.mode is Mode.LANDING

    def test_another_person_may_press_again(self):
        made = driven(*FLYING)
        made.press(PERSON, 1, 0)
        assert made.press("ben", 1, S)
        assert made.mode is Mode.LANDING

    def test_a_third_press_changes_nothing_and_counts_from_the_second(self):
        made = driven(*FLYING)
        made.press(PERSON, 1, 0)
        made.press(PERSON, 2, S)
        assert not made.press(PERSON, 3, S + S // 2 - 1)
        assert made.press(PERSON, 4, S + S // 2)
        assert made.mode is Mode.LANDING

    def test_after_a_release_a_press_is_a_first_one(self):
        made = driven(*FLYING)
        made.press(PERSON, 1, 0)
        for event in (Event.AT_REST, Event.HELD, Event.AIR_IS_OFF):
            made.apply(event, 1)
        made.apply(Event.RELEASE, 2, PERSON)
        for event in (Event.ARM, Event.FLOAT_ON):
            made.apply(event, 3, PERSON)
        made.apply(Event.AIR_IS_ON, 4)
        assert made.press(PERSON, 2, 5)
        assert made.mode is Mode.BRAKING

    def test_after_a_restart_a_press_is_a_first_one(self):
        made = machine(Mode.LANDED)
        made.recall(replace(OF_MODE[Mode.STOPPED], is_stop_latched=True), 0)
        assert made.press(PERSON, 1, 1)
        assert (made.mode, made.memory.cause) == (Mode.STOPPED, "stopped on the ground")

    def test_the_first_press_after_a_restart_while_it_lands_is_no_second_one(self):
        made = machine(Mode.LANDED)
        made.recall(replace(OF_MODE[Mode.LANDING], is_stop_latched=True), 0)
        assert made.press(PERSON, 1, 1)
        assert made.memory.cause == "stopped: lands"

    def test_the_last_sixty_four_presses_are_known(self):
        made = machine()
        for press_id in range(65):
            assert made.press(PERSON, press_id, press_id * S)
        assert not made.press(PERSON, 1, 100 * S)
        assert made.press(PERSON, 0, 101 * S)


class TestRecall:
    @pytest.mark.parametrize("mode", GROUNDED)
    def test_what_stood_stands(self, mode):
        kept = replace(OF_MODE[mode], is_flight_wanted=True, author=PERSON, cause="c")
        made = ModeMachine(0, starts_by_itself=True)
        made.recall(kept, 9)
        assert made.memory == replace(kept, since_ns=9)
        assert not made.wants_air

    @pytest.mark.parametrize("mode", BRAKEABLE)
    @pytest.mark.parametrize("then", list(Then))
    def test_what_flew_brakes_unless_it_was_about_to_land(self, mode, then):
        made = machine()
        made.recall(replace(OF_MODE[mode], then=then, author=PERSON), 9)
        after = Mode.LANDING if then is Then.LAND else Mode.BRAKING
        assert (made.mode, made.then, made.memory.since_ns) == (after, then, 9)
        assert made.wants_air is (after is Mode.BRAKING)
        assert made.memory.author == PERSON
        if after is not mode:
            assert made.memory.cause == f"started again while {mode}: why"

    @pytest.mark.parametrize("mode", [Mode.FLOATING, Mode.ARMED, Mode.LANDING, Mode.LOST])
    def test_what_was_on_air_otherwise_lands(self, mode):
        made = machine()
        made.recall(OF_MODE[mode], 9)
        assert made.mode is Mode.LANDING
        assert not made.wants_air
        assert made.memory.cause == ("why" if mode is Mode.LANDING else f"started again while {mode}: why")

    def test_a_stop_in_flight_survives_and_ends_stopped(self):
        made = machine()
        made.recall(replace(OF_MODE[Mode.BRAKING], is_stop_latched=True, then=Then.LAND), 9)
        made.apply(Event.AIR_IS_OFF, 10)
        assert made.mode is Mode.STOPPED
