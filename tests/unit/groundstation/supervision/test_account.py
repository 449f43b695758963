"""The account of a vehicle: faults with beginning and end, closures, gaps of the state, who landed it."""

import pytest

from groundstation.supervision.account import Account

IDS, LANDS, NOTES = ("imu_silent",), ("brakes, then lands",), ("flies on",)


def ruled(account, t_s, mode, author="", cause="", *, latched=False):
    account.take_ruling(t_s, mode, author, cause, is_stop_latched=latched)


def test_a_fault_has_a_beginning_an_end_and_its_last_response():
    account = Account()
    account.take_faults(1.0, IDS, ("0.15 s old",), NOTES, (True,))
    account.take_faults(1.5, IDS, ("0.65 s old",), LANDS, (True,))
    account.take_faults(2.0, IDS, ("0.65 s old",), NOTES, (False,))  # only latched
    account.take_faults(2.5, (), (), (), ())
    (episode,) = account.episodes
    assert (episode.id, episode.since_s, episode.until_s) == ("imu_silent", 1.0, 2.0)
    assert (episode.detail, episode.response) == ("0.15 s old", LANDS[0])


def test_a_fault_that_comes_again_is_another_one_and_may_last_to_the_end():
    account = Account()
    for t_s, there in ((1.0, True), (2.0, False), (3.0, True)):
        account.take_faults(t_s, IDS, ("",), NOTES, (there,))
    assert [(episode.since_s, episode.until_s) for episode in account.episodes] == [(1.0, 2.0), (3.0, None)]


def test_a_fault_that_was_latched_before_the_run_is_no_episode():
    account = Account()
    account.take_faults(0.0, IDS, ("",), NOTES, (False,))
    assert account.episodes == []


@pytest.mark.parametrize("mode", ["landing", "lost"])
def test_whom_the_station_lands_in_flight_a_fault_brought_down(mode):
    account = Account()
    ruled(account, 0.0, "flying")
    ruled(account, 1.0, mode, cause="imu_silent")
    ruled(account, 2.0, "landed", cause="it is down")
    ruled(account, 3.0, "flying")
    assert account.brought_down == "imu_silent"


@pytest.mark.parametrize(
    ("author", "latched"), [("anna", False), ("", True), ("anna", True)], ids=["land", "stop, cut", "stop"]
)
def test_whom_a_person_lands_no_fault_brought_down(author, latched):
    account = Account()
    ruled(account, 0.0, "flying")
    ruled(account, 1.0, "landing", author, latched=latched)
    assert account.brought_down == ""


def test_what_was_never_aloft_is_not_brought_down():
    account = Account()
    ruled(account, 0.0, "resting")
    ruled(account, 1.0, "lost", cause="nothing comes from the valve node")
    assert account.brought_down == ""


def test_gaps_of_the_state_count_in_the_air_alone():
    account = Account()
    account.take_state(0.0, "flying")
    ruled(account, 5.0, "armed")
    ruled(account, 5.1, "flying")  # a gap counts from take-off on
    account.take_state(5.1, "flying")
    account.take_state(5.25, "flying")
    account.take_state(5.5, "lost")  # nothing to fly on
    account.take_state(5.75, "flying")
    assert account.time_without_state_s == pytest.approx(0.5)
    ruled(account, 6.75, "landing", "anna")
    account.take_state(9.0, "flying")
    assert account.time_without_state_s == pytest.approx(1.5)


def test_closures_are_counted_where_an_open_gate_closes():
    account = Account()
    for is_open in (False, True, True, False, False, True, False):
        account.take_gate(is_open=is_open)
    assert account.closures == 2
