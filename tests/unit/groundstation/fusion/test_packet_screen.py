import math

import pytest
from oracles.packet_screen import PacketScreen


@pytest.mark.parametrize("wild", [(5.0, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.0, -1.3), (math.nan, 0.0, 0.0)])
def test_one_packet_that_jumps_away_and_back_is_wild(noise, wild):
    screen = PacketScreen(noise)
    assert not screen.is_wild(0.0, 0.0, 0.0)
    assert screen.is_wild(*wild)
    assert not screen.is_wild(0.0, 0.001, 0.0)


def test_a_push_is_believed_at_its_second_packet(noise):
    screen = PacketScreen(noise)
    screen.is_wild(0.0, 0.0, 0.0)
    assert screen.is_wild(0.0, 0.3, 0.0)
    assert not screen.is_wild(0.0, 0.31, 0.0)


def test_a_valve_that_opens_is_no_jump(noise):
    screen = PacketScreen(noise)
    screen.is_wild(0.0, 0.0, 0.0)
    assert not screen.is_wild(0.002, 0.04, -0.04)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_no_number_ever_passes_even_twice(noise, value):
    screen = PacketScreen(noise)
    assert screen.is_wild(value, 0.0, 0.0)
    assert not screen.is_wild(0.0, 0.0, 0.0)
    assert screen.is_wild(0.0, value, 0.0)
    assert screen.is_wild(0.0, value, 0.0)
