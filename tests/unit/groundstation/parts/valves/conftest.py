"""Multiplexers to hand messages to."""

from copy import deepcopy

import pytest
from unit.groundstation.parts.valves.multiplexer import MS, made, ruling, state


@pytest.fixture
def mux():
    return deepcopy(made())  # the facets of what its valves can make take a quarter of a second


@pytest.fixture
def flying(mux):
    list(mux.receive(ruling("controller"), 0))
    list(mux.receive(state(-5000 * MS), -5000 * MS))
    return mux
