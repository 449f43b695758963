"""Who may command, second by second. All stamps are made up: the mux knows no clock."""

import pytest
from pydantic import ValidationError

from groundstation.control.mux import CommandMux, MuxConfig, Selection, Source

MS = 1_000_000


@pytest.fixture
def mux():
    return CommandMux[str](MuxConfig(operator_s=0.3, controller_s=0.3, state_s=0.1))


def test_a_fresh_controller_commands(mux):
    mux.receive_state(0)
    mux.control("hold", 0)
    chosen = mux.select(20 * MS)
    assert chosen == Selection(Source.CONTROLLER, "hold", True, "controller is fresh")
    assert not mux.select(40 * MS).is_new
    mux.control("hold", 50 * MS)
    assert mux.select(60 * MS).is_new


def test_the_operator_overrides_the_controller_and_hands_back_by_falling_silent(mux):
    mux.control("hold", 0)
    mux.operate("left", 0)
    assert mux.select(0) == Selection(Source.OPERATOR, "left", True, "operator is fresh")
    mux.control("hold", 300 * MS)
    assert mux.select(300 * MS) == Selection(Source.OPERATOR, "left", False, "operator is fresh")
    assert mux.select(301 * MS).source is Source.CONTROLLER


def test_the_newest_demand_of_a_source_counts(mux):
    mux.control("hold", 0)
    mux.control("move", 10 * MS)
    assert mux.select(10 * MS).demand == "move"


def test_silence_of_the_controller_brakes_for_closed_valves_mean_coasting(mux):
    mux.control("hold", 100 * MS)
    mux.receive_state(500 * MS)
    assert mux.select(400 * MS).source is Source.CONTROLLER
    chosen = mux.select(500 * MS)
    assert chosen == Selection(Source.BRAKE, None, False, "controller silent for 400 ms")


def test_a_controller_that_never_demanded_anything_brakes_too(mux):
    mux.receive_state(0)
    assert mux.select(0) == Selection(Source.BRAKE, None, False, "nothing received from the controller yet")


def test_silence_of_the_operator_alone_is_not_that_of_the_controller(mux):
    mux.receive_state(400 * MS)
    mux.operate("left", 0)
    assert mux.select(400 * MS).reason == "nothing received from the controller yet"


def test_braking_by_order_has_the_reason_of_who_orders_it(mux):
    mux.receive_state(0)
    mux.control("hold", 0)
    assert mux.brake(0, "braking: edge ahead") == Selection(Source.BRAKE, None, False, "braking: edge ahead")
    assert mux.select(0).demand == "hold"


def test_without_a_fresh_state_nothing_can_brake_and_all_valves_close(mux):
    assert mux.select(0) == Selection(
        Source.CLOSED,
        None,
        False,
        "nothing received from the controller yet; no state ever arrived to brake with",
    )
    mux.receive_state(0)
    assert mux.brake(100 * MS, "operator").source is Source.BRAKE
    late = mux.brake(101 * MS, "operator")
    assert late == Selection(
        Source.CLOSED, None, False, "operator; state is 101 ms old, too old to brake with"
    )
    assert mux.select(101 * MS).source is Source.CLOSED


def test_a_state_of_stamp_zero_is_a_state(mux):
    mux.receive_state(0)
    assert mux.brake(0, "x").source is Source.BRAKE


def test_demands_that_were_forgotten_do_not_come_back_to_life(mux):
    mux.receive_state(0)
    mux.control("hold", 0)
    mux.operate("left", 0)
    mux.forget()
    assert mux.select(1) == Selection(Source.BRAKE, None, False, "nothing received from the controller yet")
    mux.control("hold again", 2)
    assert mux.select(2) == Selection(Source.CONTROLLER, "hold again", True, "controller is fresh")


def test_who_commands_from_outside_has_it_until_it_is_given_back(mux):
    mux.receive_state(0)
    mux.control("hold", 0)
    mux.command_from_outside("spin", 0)
    assert mux.select(0) == Selection(Source.OUTSIDE, "spin", True, "outside is fresh")
    mux.operate("left", 0)
    assert mux.select(0).source is Source.OPERATOR
    mux.receive_state(400 * MS)
    mux.control("hold", 400 * MS)
    assert mux.select(400 * MS) == Selection(Source.BRAKE, None, False, "outside silent for 400 ms")
    mux.give_back()
    assert mux.select(400 * MS).source is Source.CONTROLLER
    mux.command_from_outside("spin", 410 * MS)
    mux.forget()
    assert mux.select(410 * MS).reason == "nothing received from the outside yet"


@pytest.mark.parametrize("key", ["operator_s", "outside_s", "controller_s", "state_s"])
def test_every_source_has_a_freshness_of_its_own(key):
    config = MuxConfig(
        **{**dict.fromkeys(("operator_s", "outside_s", "controller_s", "state_s"), 10.0), key: 0.05}
    )
    mux = CommandMux[str](config)
    mux.receive_state(0)
    offers = {
        "operator_s": lambda: mux.operate("left", 0),
        "outside_s": lambda: mux.command_from_outside("spin", 0),
        "controller_s": lambda: mux.control("hold", 0),
        "state_s": lambda: None,
    }
    offers[key]()
    assert mux.select(50 * MS).source is not mux.select(51 * MS).source


def test_unless_stated_demands_live_for_more_than_two_periods_and_states_for_two_seconds():
    config = MuxConfig()
    assert (config.operator_s, config.outside_s, config.controller_s, config.state_s) == (
        0.3,
        0.24,
        0.24,
        2.0,
    )


@pytest.mark.parametrize(
    "given", [{"operator_s": 0.0}, {"controller_s": -1.0}, {"state_s": 0.0}, {"brake_s": 1.0}]
)
def test_a_freshness_that_is_none_is_refused(given):
    with pytest.raises(ValidationError, match=next(iter(given))):
        MuxConfig(**given)


def test_what_was_configured_stays():
    with pytest.raises(ValidationError, match="frozen"):
        MuxConfig().state_s = 3.0
