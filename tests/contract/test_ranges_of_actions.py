"""Every number that an action takes has a range, and what is beyond it is refused in a short sentence."""

import math

import pytest

from groundstation.declarations.request import ArgumentError
from groundstation.parts.table import installed_tables

ACTIONS = installed_tables().actions


@pytest.mark.parametrize("name", ACTIONS)
def test_every_number_has_a_range(name):
    for argument in ACTIONS[name].arguments:
        if argument.kind in (int, float):
            assert -1e6 < argument.low < argument.high < 1e6, argument.name


@pytest.mark.parametrize("wild", [1e308, -1e308, math.inf, math.nan, 10**400, 1e9])
@pytest.mark.parametrize("name", ACTIONS)
def test_what_nobody_means_is_refused_in_a_short_sentence(name, wild):
    for argument in ACTIONS[name].arguments:
        if argument.kind in (int, float):
            with pytest.raises(ArgumentError) as refused:
                argument.read(wild, name)
            assert argument.name in str(refused.value)
            assert len(str(refused.value)) < 120
