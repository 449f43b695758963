"""Who may command, second by second. All stamps are made up: the mux knows no clock."""

import pytest

from groundstation.control.mux import CommandMux, MuxConfig, Source

MS = 1_000_000


@pytest.fixture
def mux():
    return CommandMux[str](MuxConfig(brake_s=0.3, operator_s=0.3, controller_s=0.3, state_s=0.1))


def test_a_fresh_controller_commands(mux):
    mux.receive_state(0)
    mux.control("hold", 0)
    chosen = mux.select(20 * MS)
    assert (chosen.source, chosen.demand, chosen.is_new) == (Source.CONTROLLER, "hold", True)
    assert not mux.select(40 * MS).is_new


def test_the_operator_overrides_the_controller_and_hands_back_by_falling_silent(mux):
    mux.control("hold", 0)
    mux.operate("left", 0)
    assert mux.select(0).source is Source.OPERATOR
    mux.control("hold", 300 * MS)
    assert mux.select(301 * MS).source is Source.CONTROLLER


def test_brake_overrides_operator_and_controller(mux):
    mux.receive_state(0)
    mux.control("hold", 0)
    mux.operate("left", 0)
    mux.brake(0, "edge ahead")
    chosen = mux.select(0)
    assert (chosen.source, chosen.demand, chosen.reason) == (Source.BRAKE, None, "brake: edge ahead")


def test_a_brake_that_is_not_repeated_ends(mux):
    mux.receive_state(0)
    mux.brake(0, "edge ahead")
    mux.control("hold", 290 * MS)
    mux.receive_state(290 * MS)
    assert mux.select(300 * MS).source is Source.BRAKE
    assert mux.select(301 * MS).source is Source.CONTROLLER


def test_silence_of_the_controller_brakes_for_closed_valves_mean_coasting(mux):
    mux.control("hold", 0)
    mux.receive_state(400 * MS)
    chosen = mux.select(400 * MS)
    assert chosen.source is Source.BRAKE
    assert chosen.reason == "controller silent for 400 ms"


def test_a_controller_that_never_spoke_brakes_too(mux):
    mux.receive_state(0)
    assert mux.select(0).reason == "nothing received from the controller yet"
    assert mux.select(0).source is Source.BRAKE


def test_without_a_fresh_state_nothing_can_brake_and_all_valves_close(mux):
    assert mux.select(0).source is Source.CLOSED
    mux.receive_state(0)
    mux.brake(100 * MS, "operator")
    assert mux.select(100 * MS).source is Source.BRAKE
    late = mux.select(101 * MS)
    assert late.source is Source.CLOSED
    assert "state is 101 ms old" in late.reason


def test_a_stop_beats_everything_and_does_not_grow_old(mux):
    mux.stop("red button")
    for stamp_ns in (0, 10**12):
        mux.receive_state(stamp_ns)
        mux.brake(stamp_ns, "operator")
        mux.operate("left", stamp_ns)
        mux.control("hold", stamp_ns)
        chosen = mux.select(stamp_ns)
        assert (chosen.source, chosen.demand, chosen.reason) == (Source.STOP, None, "stop: red button")


def test_after_a_stop_old_demands_do_not_come_back_to_life(mux):
    mux.receive_state(0)
    mux.control("hold", 0)
    mux.stop("red button")
    mux.release_stop()
    assert mux.select(1).source is Source.BRAKE
    mux.control("hold again", 2)
    assert mux.select(2).demand == "hold again"


@pytest.mark.parametrize("key", ["brake_s", "operator_s", "controller_s", "state_s"])
def test_every_source_has_a_freshness_of_its_own(key):
    config = MuxConfig(
        **{**dict.fromkeys(("brake_s", "operator_s", "controller_s", "state_s"), 10.0), key: 0.05}
    )
    mux = CommandMux[str](config)
    mux.receive_state(0)
    offers = {
        "brake_s": lambda: mux.brake(0, "x"),
        "operator_s": lambda: mux.operate("left", 0),
        "controller_s": lambda: mux.control("hold", 0),
        "state_s": lambda: None,
    }
    offers[key]()
    assert mux.select(50 * MS) != mux.select(51 * MS)
