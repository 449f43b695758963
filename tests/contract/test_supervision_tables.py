"""The tables of supervision: modes, transitions, faults and checks are complete and fit each other."""

import itertools
from pathlib import Path

import pytest

from firmware_emulator.device_table import device_kinds, failure_kinds
from groundstation.parts.supervision.actions import ACTIONS
from groundstation.supervision import arming, modes
from groundstation.supervision.faults import FAULTS, Clears, Response
from groundstation.supervision.mode_machine import ModeMachine
from groundstation.supervision.modes import (
    ALOFT,
    BRAKEABLE,
    GROUNDED,
    GUARANTEES,
    TRANSITIONS,
    Air,
    Event,
    Law,
    Mode,
    Who,
    transition,
)

DOWN = frozenset({Mode.LANDING, Mode.LANDED, Mode.STOPPED})


def test_every_mode_has_a_guarantee_in_words():
    assert set(GUARANTEES) == set(Mode)
    assert all(guarantee.summary.endswith(".") for guarantee in GUARANTEES.values())


@pytest.mark.parametrize("mode", Mode)
def test_where_the_law_is_closed_valves_may_not_open_except_armed(mode):
    guarantee = GUARANTEES[mode]
    assert guarantee.may_open is (guarantee.law is not Law.CLOSED or mode is Mode.ARMED)


@pytest.mark.parametrize("mode", Mode)
def test_valves_push_only_on_air_and_air_is_on_only_where_it_is_said(mode):
    guarantee = GUARANTEES[mode]
    assert guarantee.law is Law.CLOSED or guarantee.air is Air.ON
    assert (guarantee.law is not Law.CLOSED) is (mode in BRAKEABLE)
    assert (guarantee.air is not Air.OFF) is (mode in ALOFT)
    assert not (mode in GROUNDED and mode in ALOFT)


def test_no_mode_and_event_stand_in_two_rows():
    pairs = [(mode, row.event) for row in TRANSITIONS for mode in row.before]
    assert len(pairs) == len(set(pairs))
    for row in TRANSITIONS:
        assert all(transition(mode, row.event) is row for mode in row.before)


def test_an_event_that_no_row_names_is_none():
    assert transition(Mode.FLYING, Event.READY) is None


def test_an_event_is_a_persons_or_the_stations_and_has_a_cause():
    for event in Event:
        rows = [row for row in TRANSITIONS if row.event is event]
        assert rows, event
        assert len({row.who for row in rows}) == 1
        assert all(row.cause for row in rows)


def test_what_can_be_requested_is_what_is_a_persons():
    persons = {row.event for row in TRANSITIONS if row.who is Who.PERSON}
    assert persons - {Event.STOP_AGAIN} == {Event(name) for name in ACTIONS}


@pytest.mark.parametrize("mode", Mode)
@pytest.mark.parametrize("name", sorted(ACTIONS))
def test_every_request_counts_in_a_mode_or_is_refused_in_a_sentence(mode, name):
    machine = ModeMachine(0, starts_by_itself=False)
    object.__setattr__(machine.memory, "mode", mode)
    refusal = machine.apply(Event(name), 0, "anna")
    assert (refusal == "") is (transition(mode, Event(name)) is not None)
    assert refusal == "" or len(refusal.split()) > 4


@pytest.mark.parametrize("mode", Mode)
def test_landing_disarming_cutting_the_air_and_stopping_twice_lead_down_at_once_from_everywhere(mode):
    for event in (Event.LAND, Event.DISARM, Event.FLOAT_OFF, Event.STOP_AGAIN):
        assert transition(mode, event).after in DOWN


@pytest.mark.parametrize("mode", Mode)
def test_a_stop_leads_down_or_brakes_from_everywhere(mode):
    after = transition(mode, Event.STOP).after
    assert after is Mode.BRAKING if mode in BRAKEABLE else after in DOWN


def test_only_a_person_leads_out_of_stopped_and_of_landed():
    for row in TRANSITIONS:
        if row.before & {Mode.STOPPED, Mode.LANDED}:
            assert row.who is Who.PERSON, row


def test_out_of_stopped_only_a_release_leads():
    out = {row.event for row in TRANSITIONS if Mode.STOPPED in row.before and row.after is not Mode.STOPPED}
    assert out == {Event.RELEASE}


def test_whatever_arms_is_gated_and_nothing_else_is():
    for row in TRANSITIONS:
        arms = row.after is Mode.ARMED and row.before != {Mode.ARMED}
        assert row.is_gated is arms, row


def test_valves_open_only_after_armed_or_in_flight():
    for row in TRANSITIONS:
        if GUARANTEES[row.after].law is Law.CONTROLLER:
            assert row.before <= {Mode.ARMED, *BRAKEABLE}, row
        if GUARANTEES[row.after].law is Law.BRAKE:
            assert row.before <= set(BRAKEABLE), row


def test_from_every_mode_in_the_air_a_silent_node_and_a_fault_that_cuts_are_answered():
    for mode in ALOFT:
        assert transition(mode, Event.NODE_SILENT).after is Mode.LOST
        assert transition(mode, Event.FAULT_CUTS).after is Mode.LANDING
        assert transition(mode, Event.FAULT_LANDS).after in (Mode.BRAKING, Mode.LANDING)


# -- faults -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fault", FAULTS.values(), ids=lambda fault: fault.id)
def test_a_fault_is_a_whole_row(fault):
    assert fault.within_s > 0.0
    assert fault.what.endswith(".")
    assert fault.advice.endswith(".")
    assert fault.found_by
    assert not fault.may_be_overridden or fault.steps[0][1] < Response.CUT
    assert fault.within_s >= fault.confirm_s >= 0.0
    assert fault.blocks_arming or not fault.may_be_overridden


@pytest.mark.parametrize("fault", FAULTS.values(), ids=lambda fault: fault.id)
def test_its_response_begins_at_once_and_only_grows(fault):
    assert fault.steps[0][0] == 0.0
    for (after_s, response), (later_s, stronger) in itertools.pairwise(fault.steps):
        assert later_s > after_s
        assert stronger > response


@pytest.mark.parametrize("fault", FAULTS.values(), ids=lambda fault: fault.id)
def test_its_failures_can_be_injected(fault):
    assert set(fault.failures) <= set(failure_kinds(device_kinds()))


def test_every_fault_is_found_by_something():
    package = Path(modes.__file__).parents[1]
    folders = (package / "supervision", package / "parts")
    code = [path for folder in folders for path in folder.rglob("*.py") if path.name != "faults.py"]
    text = "".join(path.read_text() for path in code)
    assert [fault for fault in FAULTS if f'"{fault}"' not in text] == []


def test_what_a_person_must_clear_keeps_it_down_or_has_brought_it_down():
    for fault in FAULTS.values():
        if fault.clears is Clears.PERSON and not fault.blocks_arming:
            assert fault.steps == ((0.0, Response.CUT),), fault.id


def test_what_lands_a_flying_vehicle_keeps_one_on_the_ground_or_needs_flight_to_be_seen():
    for fault in FAULTS.values():
        strongest = max(response for _, response in fault.steps)
        if strongest >= Response.LAND and not fault.blocks_arming:
            assert fault.id in (
                "node_disobeys",
                "controller_silent",
                "edge_unavoidable",
                "vehicle_unavoidable",
            )


# -- checks of the arming gate ------------------------------------------------------------------------


def test_checks_have_names_of_their_own_and_say_what_must_hold():
    assert len({check.name for check in arming.CHECKS}) == len(arming.CHECKS)
    assert all(check.summary for check in arming.CHECKS)
