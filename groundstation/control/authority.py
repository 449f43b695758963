"""What the valves can do along a way: acceleration and braking, with the pull of the table."""

from typing import NamedTuple

from groundstation.control.state import BodyWrench, Vector2, rotate
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope

_MORE_THAN_ANY_N = 1e6
_LEAST_SHARE = 0.1  # of the valves' own: on a slope that eats all of it nothing could be planned


class Authority(NamedTuple):
    """Along a direction, m/s^2: what the valves give forwards and backwards, and what the table adds."""

    forwards_m_s2: float
    backwards_m_s2: float
    pull_m_s2: float

    def accelerating(self, share: float) -> float:
        """Acceleration with a share of the valves' force."""
        return max(share * self.forwards_m_s2 + self.pull_m_s2, _LEAST_SHARE * self.forwards_m_s2)

    def braking(self, share: float) -> float:
        """Deceleration with a share of the valves' force."""
        return max(share * self.backwards_m_s2 - self.pull_m_s2, _LEAST_SHARE * self.backwards_m_s2)


def authority_along(
    direction_table: Vector2,
    heading_rad: float | None,
    pull_table_m_s2: Vector2,
    vehicle: VehicleModel,
    envelope: WrenchEnvelope,
) -> Authority:
    """What can be counted on along a way.

    Args:
        direction_table: Unit vector of the way.
        heading_rad: Of the mock-up; None where it turns on the way, so that only what the valves give
            in every direction counts.
        pull_table_m_s2: Acceleration by slope and unknown disturbances, (x, y).
        vehicle: Mass properties.
        envelope: What its valves can make.
    """
    pull = pull_table_m_s2[0] * direction_table[0] + pull_table_m_s2[1] * direction_table[1]
    if heading_rad is None:
        least = envelope.max_force_n / vehicle.mass_kg
        return Authority(least, least, pull)
    body = rotate(direction_table, -heading_rad)
    forwards, backwards = (
        envelope.saturate(
            BodyWrench((side * _MORE_THAN_ANY_N * body[0], side * _MORE_THAN_ANY_N * body[1]), 0.0)
        ).force_body_n
        for side in (1.0, -1.0)
    )
    mass_kg = vehicle.mass_kg
    return Authority(
        (forwards[0] * body[0] + forwards[1] * body[1]) / mass_kg,
        -(backwards[0] * body[0] + backwards[1] * body[1]) / mass_kg,
        pull,
    )
