"""An armed guard with its commander."""

import pytest
from unit.drivers.valve_bus.commander import MS, WIDE, Source

from drivers.valve_bus.guard import Guard


@pytest.fixture
def flying():
    source = Source(Guard(1, WIDE))
    source.say()
    source.say()
    assert source.guard.arm(source.now_ms * MS)
    source.tick()
    return source
