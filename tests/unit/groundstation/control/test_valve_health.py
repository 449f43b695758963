"""What a valve gives: the states by value, and where they end."""

import pytest

from groundstation.control.valve_health import (
    HEALTHY,
    LEAST_SHARE,
    MOST_SHARE,
    STUCK_CLOSED,
    ValveHealth,
    health_of,
    leaking,
    shares,
    stuck_open,
    weak,
)


def test_the_states_by_value():
    assert (LEAST_SHARE, MOST_SHARE) == (0.05, 2.0)
    assert ValveHealth() == HEALTHY
    assert (HEALTHY.open_share, HEALTHY.shut_share) == (1.0, 0.0)
    assert (STUCK_CLOSED.open_share, STUCK_CLOSED.shut_share) == (0.0, 0.0)
    assert weak(0.3) == ValveHealth(0.3, 0.0)
    assert stuck_open() == ValveHealth(1.0, 1.0)
    assert stuck_open(0.8) == ValveHealth(0.8, 0.8)
    assert leaking(0.2) == ValveHealth(1.0, 0.2)
    assert leaking(1.2) == ValveHealth(1.2, 1.2)


@pytest.mark.parametrize(("opened", "shut"), [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0)])
def test_the_ends_belong_to_it(opened, shut):
    health = ValveHealth(opened, shut)
    assert (health.open_share, health.shut_share) == (opened, shut)


@pytest.mark.parametrize(("opened", "shut"), [(1.0, -0.01), (0.5, 0.51), (2.01, 0.0), (float("nan"), 0.0)])
def test_what_no_valve_can_give_is_refused(opened, shut):
    with pytest.raises(ValueError, match="0 <= shut <= open <= 2"):
        ValveHealth(opened, shut)


@pytest.mark.parametrize(("opened", "obeys"), [(0.05, True), (0.052, True), (0.048, False), (0.0, False)])
def test_a_command_has_to_make_a_difference(opened, obeys):
    assert ValveHealth(opened).obeys is obeys
    assert ValveHealth(0.5 + opened + 1e-12, 0.5).obeys is obeys


def test_states_of_a_message():
    assert health_of((1.0, 0.5), (0.0, 0.2)) == (ValveHealth(), ValveHealth(0.5, 0.2))
    for rows in (((1.0, 1.0), (0.0,)), ((1.0,), (0.0, 0.0))):
        with pytest.raises(ValueError, match="zip"):
            health_of(*rows)


def test_what_commands_add_and_what_comes_without():
    added, idle = shares((ValveHealth(0.9, 0.2), ValveHealth(0.5, 0.48), HEALTHY), 3)
    assert added.tolist() == pytest.approx([0.7, 0.0, 1.0])
    assert idle.tolist() == [0.2, 0.48, 0.0]
    for count in (2, 4):
        with pytest.raises(ValueError, match=f"each of {count} valves needs a state of health, found 3"):
            shares((HEALTHY,) * 3, count)
