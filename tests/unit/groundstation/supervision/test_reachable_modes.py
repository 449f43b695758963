"""Every state that the state machine can reach, explored: what leads out of each, and what never does."""

import itertools

import pytest
from unit.groundstation.supervision.machines import (
    FLYING,
    PERSON,
    PERSONS,
    STATIONS,
    S,
    driven,
    machine,
)

from groundstation.supervision.mode_machine import (
    GRACE_S,
    ModeMachine,
    Then,
)
from groundstation.supervision.modes import (
    GROUNDED,
    GUARANTEES,
    Air,
    Event,
    Law,
    Mode,
    transition,
)


def key(made):
    memory = made.memory
    return memory.mode, memory.is_stop_latched, memory.is_flight_wanted, memory.then, made.wants_air


def made_of(state):
    mode, latched, wanted, then, wants_air = state
    made = machine(mode, is_stop_latched=latched, is_flight_wanted=wanted, then=then)
    made.wants_air = wants_air
    return made


def after(state, event):
    """The state that an event leads to; the same where it is refused."""
    made = made_of(state)
    made.apply(event, 0, PERSON if event in PERSONS else "")
    return key(made)


def reachable(begins, steps):
    """All states that are reached from some by repeated steps."""
    known, left = set(begins), list(begins)
    while left:
        state = left.pop()
        for new in steps(state):
            if new not in known:
                known.add(new)
                left.append(new)
    return known


def any_event(state):
    restarted = machine()
    restarted.recall(made_of(state).memory, 0)
    return [*(after(state, event) for event in Event), key(restarted)]


def any_event_but_release(state):
    restarted = machine()
    restarted.recall(made_of(state).memory, 0)
    return [*(after(state, event) for event in Event if event is not Event.RELEASE), key(restarted)]


def station_events(state):
    return [after(state, event) for event in STATIONS]


REACHED = reachable([key(ModeMachine(0, starts_by_itself=first)) for first in (False, True)], any_event)


def is_air_off(state):
    return GUARANTEES[state[0]].air is Air.OFF


def test_every_mode_is_reached_and_the_states_are_few():
    assert {state[0] for state in REACHED} == set(Mode)
    assert len(REACHED) < 200


@pytest.mark.parametrize("event", [Event.LAND, Event.DISARM, Event.FLOAT_OFF, Event.STOP_AGAIN])
def test_from_every_state_landing_orders_the_air_off_at_once(event):
    for state in REACHED:
        assert made_of(state).apply(event, 0, PERSON) == ""
        assert is_air_off(after(state, event)), (state, event)


@pytest.mark.parametrize("rests", [(False,), (True,), (False, True), (True, False)])
def test_from_every_state_a_stop_orders_the_air_off_within_its_grace_by_time_alone(rests):
    for state in REACHED:
        made = made_of(state)
        assert made.press(PERSON, 1, 0)
        now_ns = 0
        for rest in itertools.cycle(rests):
            if is_air_off(key(made)) or now_ns > GRACE_S * S:
                break
            now_ns += S // 10
            made.pass_time(now_ns, is_at_rest=rest)
        assert is_air_off(key(made)), state
        assert now_ns <= GRACE_S * S


def test_from_every_state_a_stop_can_end_stopped_by_what_the_station_does():
    for state in REACHED:
        stopped = after(state, Event.STOP)
        assert any(end[0] is Mode.STOPPED for end in reachable([stopped], station_events)), state


def test_after_a_stop_nothing_but_a_release_opens_valves_beyond_braking():
    begins = [after(state, Event.STOP) for state in REACHED]
    for state in reachable(begins, any_event_but_release):
        guarantee = GUARANTEES[state[0]]
        assert state[1], state
        assert guarantee.law is not Law.CONTROLLER, state
        assert not guarantee.may_open or guarantee.law is Law.BRAKE, state


def test_after_a_stop_has_ended_nothing_but_a_release_leaves_it_whatever_restarts():
    begins = [state for state in REACHED if state[0] is Mode.STOPPED]
    assert {state[0] for state in reachable(begins, any_event_but_release)} == {Mode.STOPPED}


def test_out_of_landed_only_a_person_leads_where_flight_is_not_wanted():
    begins = [state for state in REACHED if state[0] is Mode.LANDED]
    assert not any(state[2] for state in begins)
    assert {state[0] for state in reachable(begins, station_events)} == {Mode.LANDED}


def test_after_landing_by_request_only_a_person_lets_it_fly():
    for event in (Event.LAND, Event.DISARM, Event.FLOAT_OFF):
        begins = [after(state, event) for state in REACHED]
        ends = {state[0] for state in reachable(begins, station_events)}
        assert ends <= {Mode.LANDING, Mode.LOST, Mode.LANDED, Mode.STOPPED}, event


def test_what_floats_unarmed_was_asked_for_by_a_person():
    begins = [state for state in REACHED if state[0] is not Mode.FLOATING]
    for state in begins:
        assert all(new[0] is not Mode.FLOATING for new in station_events(state)), state


def test_a_stopped_vehicle_is_always_latched_and_a_flying_one_has_nothing_to_brake_for():
    for mode, latched, _, then, wants_air in REACHED:
        assert latched or mode is not Mode.STOPPED
        assert not latched or mode in (Mode.STOPPED, Mode.BRAKING, Mode.HOLDING, Mode.LANDING, Mode.LOST)
        assert then is Then.FLY or mode is not Mode.FLYING
        assert not latched or then is Then.LAND
        assert not (wants_air and mode in (Mode.LANDED, Mode.STOPPED, Mode.RESTING, Mode.LOST))


def test_what_can_be_requested_is_in_the_table_or_refused_in_a_sentence():
    for state, event in itertools.product(REACHED, PERSONS):
        made = made_of(state)
        refusal = made.apply(event, 0, PERSON)
        if transition(state[0], event) is None:
            assert len(refusal.split()) > 4, (state, event)
            assert key(made) == state
        elif refusal:
            assert event is Event.RESUME
            assert refusal.startswith(("it is about to land", "a stop is latched")), (state, refusal)


@pytest.mark.parametrize(
    "landing",
    [
        (Event.LAND,),
        (Event.DISARM,),
        (Event.FLOAT_OFF,),
        (Event.STOP, Event.AT_REST, Event.HELD),
        (Event.STOP_AGAIN,),
        (Event.FAULT_LANDS, Event.AT_REST, Event.HELD),
        (Event.FAULT_CUTS,),
        (Event.BRAKE, Event.LAND),
        (Event.NODE_SILENT, Event.NODE_BACK),
        (Event.NODE_SILENT, Event.STOP),
    ],
)
def test_after_each_kind_of_landing_it_flies_again_when_asked_to(landing):
    made = driven(*FLYING, *landing)
    assert made.apply(Event.AIR_IS_OFF, 0) == ""
    assert made.mode in GROUNDED
    if made.mode is Mode.STOPPED:
        assert made.apply(Event.RELEASE, 0, PERSON) == ""
    for event in FLYING:
        assert made.apply(event, 0, PERSON if event in PERSONS else "") == ""
    assert made.mode is Mode.FLYING
    assert made.wants_air
    assert made.press(PERSON, 99, 10 * S)
    assert made.mode is Mode.BRAKING
