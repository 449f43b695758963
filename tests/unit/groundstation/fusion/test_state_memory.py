"""The state at a moment between two states."""

import numpy as np
import pytest

from groundstation.fusion.state_memory import REACH_NS, StateMemory
from groundstation.parts.fusion.messages import VehicleState

PERIOD_NS = 10_000_000


def moving(t_s):
    """x and y on a parabola, heading through the seam of the circle."""
    return (0.1 * t_s + 0.2 * t_s**2, -0.05 * t_s), (0.1 + 0.4 * t_s, -0.05), 3.1 + 0.5 * t_s


def state(stamp_ns, status="flying"):
    position, velocity, heading = moving(stamp_ns * 1e-9)
    turned = float(np.angle(np.exp(1j * heading)))
    return VehicleState(stamp_ns, "alpha", position, turned, velocity, 0.5, (1e-3,) * 3, status, 0)


def filled(count=300):
    memory = StateMemory()
    for i in range(count):
        memory.remember(state(i * PERIOD_NS))
    return memory


@pytest.mark.parametrize("offset_ns", [0, 1, 3_700_000, 9_999_999])
def test_between_two_states_it_is_that_of_the_motion(offset_ns):
    stamp_ns = 250 * PERIOD_NS + offset_ns
    found = filled().at(stamp_ns)
    position, velocity, heading = moving(stamp_ns * 1e-9)
    assert found.stamp_ns == stamp_ns
    assert found.position_table_m == pytest.approx(position, abs=6e-6)  # an eighth of a T^2
    assert found.velocity_table_m_s == pytest.approx(velocity, abs=1e-9)
    assert np.exp(1j * found.heading_rad) == pytest.approx(np.exp(1j * heading), abs=1e-9)
    assert -np.pi <= found.heading_rad < np.pi


def test_after_the_newest_it_is_carried_on_but_not_far():
    memory, newest_ns = filled(), 299 * PERIOD_NS
    assert memory.at(newest_ns + REACH_NS).position_table_m == pytest.approx(
        moving((newest_ns + REACH_NS) * 1e-9)[0], abs=6e-4
    )
    assert memory.at(newest_ns + REACH_NS + 1) is None


def test_it_reaches_back_two_seconds_and_knows_nothing_of_a_lost_filter():
    memory = filled()
    assert memory.at(100 * PERIOD_NS) is not None
    assert memory.at(98 * PERIOD_NS) is None
    memory.remember(state(300 * PERIOD_NS, "lost"))
    assert memory.at(250 * PERIOD_NS) is None


def test_a_gap_in_the_states_is_not_bridged():
    memory = StateMemory()
    memory.remember(state(0))
    memory.remember(state(30 * PERIOD_NS))
    assert memory.at(10 * PERIOD_NS) is None
    assert memory.at(4 * PERIOD_NS).position_table_m == pytest.approx(moving(0.04)[0], abs=4e-4)
