"""Bumpers against each other and against the rail at the table's edge.

Bodies are frictionless discs. A contact is an impulse with restitution, spread over the time a rubber
bumper stays squeezed, so that the IMU feels a shock of finite height. Momentum is exchanged exactly; the
penetration meanwhile is the closing speed times that time, about 1 mm at 0.1 m/s.
"""

import math
from collections.abc import Sequence

from firmware_emulator.plant.rigid_body import Vehicle

SQUEEZE_NS = 10_000_000  # about half a period of 11 kg on a bumper of 1 N/um
_SPEED_MARGIN_M_S = 0.05  # what thrust (0.08 m/s^2) can add within the look-ahead
_LONGEST_LOOK_AHEAD_NS = 200_000_000
NS_PER_S = 1_000_000_000


class Contacts:
    """Finds contacts and pushes the vehicles apart; called whenever all vehicles are at one time.

    Args:
        bounds_m: x_min, x_max, y_min, y_max of the table.
        edge_restitution: Of the rail.
        contact_restitution: Of two bumpers.
    """

    def __init__(
        self,
        bounds_m: tuple[float, float, float, float],
        edge_restitution: float,
        contact_restitution: float,
    ) -> None:
        self._bounds_m = bounds_m
        self._edge_restitution = edge_restitution
        self._contact_restitution = contact_restitution
        self._busy_until_ns: dict[tuple[int, int], int] = {}
        self.count = 0

    def resolve(self, vehicles: Sequence[Vehicle]) -> int:
        """Push apart what touches; return the moment (ns) by which to be called again.

        All vehicles are at the same time. Nothing can touch before the returned moment.
        """
        now_ns = vehicles[0].now_ns
        soonest_s = _LONGEST_LOOK_AHEAD_NS / NS_PER_S
        for index, vehicle in enumerate(vehicles):
            soonest_s = min(soonest_s, self._edges(index, vehicle, now_ns))
            for other_index in range(index):
                soonest_s = min(soonest_s, self._pair(index, vehicle, other_index, vehicles[other_index]))
        return now_ns + max(SQUEEZE_NS, round(soonest_s * NS_PER_S))

    def _edges(self, index: int, vehicle: Vehicle, now_ns: int) -> float:
        """Treat the four rails; return a time in s before which none is reached."""
        origin = vehicle.origin_at(now_ns)
        x_min, x_max, y_min, y_max = self._bounds_m
        radius = vehicle.body.radius_m
        nearest_m = math.inf
        for side, (gap_m, normal_x, normal_y) in enumerate(
            (
                (origin.x_m - x_min - radius, 1.0, 0.0),
                (x_max - radius - origin.x_m, -1.0, 0.0),
                (origin.y_m - y_min - radius, 0.0, 1.0),
                (y_max - radius - origin.y_m, 0.0, -1.0),
            )
        ):
            nearest_m = min(nearest_m, gap_m)
            closing_m_s = -(origin.vx_m_s * normal_x + origin.vy_m_s * normal_y)
            if gap_m <= 0.0 and closing_m_s > 0.0 and self._begin((index, -1 - side), now_ns):
                impulse = (1.0 + self._edge_restitution) * vehicle.body.mass_kg * closing_m_s
                vehicle.push(impulse * normal_x, impulse * normal_y, SQUEEZE_NS)
        speed = math.hypot(origin.vx_m_s, origin.vy_m_s)
        return max(0.0, nearest_m) / (speed + _SPEED_MARGIN_M_S)

    def _pair(self, index: int, one: Vehicle, other_index: int, other: Vehicle) -> float:
        """Treat two bumpers; return a time in s before which they do not touch."""
        a, b = one.origin_at(one.now_ns), other.origin_at(one.now_ns)
        dx, dy = a.x_m - b.x_m, a.y_m - b.y_m
        distance_m = math.hypot(dx, dy)
        gap_m = distance_m - one.body.radius_m - other.body.radius_m
        closing_x, closing_y = b.vx_m_s - a.vx_m_s, b.vy_m_s - a.vy_m_s
        if gap_m <= 0.0:
            normal_x, normal_y = (dx / distance_m, dy / distance_m) if distance_m > 0.0 else (1.0, 0.0)
            closing_m_s = closing_x * normal_x + closing_y * normal_y
            if closing_m_s > 0.0 and self._begin((index, other_index), one.now_ns):
                # Dry friction holds a landed vehicle like a wall.
                give = (one.is_floating / one.body.mass_kg) + (other.is_floating / other.body.mass_kg)
                reduced_kg = 1.0 / give if give > 0.0 else 0.0
                impulse = (1.0 + self._contact_restitution) * reduced_kg * closing_m_s
                one.push(impulse * normal_x, impulse * normal_y, SQUEEZE_NS)
                other.push(-impulse * normal_x, -impulse * normal_y, SQUEEZE_NS)
        speed = math.hypot(closing_x, closing_y)
        return max(0.0, gap_m) / (speed + 2.0 * _SPEED_MARGIN_M_S)

    def _begin(self, key: tuple[int, int], now_ns: int) -> bool:
        """Whether this contact is a new one; a squeezed bumper has had its impulse already."""
        if self._busy_until_ns.get(key, -1) > now_ns:
            return False
        self._busy_until_ns[key] = now_ns + SQUEEZE_NS
        self.count += 1
        return True


class ContactWatch:
    """Looks for contacts as often as they can happen.

    Args:
        vehicles: All that can touch, at one time.
        contacts: Pushes them apart.
    """

    def __init__(self, vehicles: Sequence[Vehicle], contacts: Contacts) -> None:
        self._vehicles, self._contacts = vehicles, contacts
        self.next_ns = 0
        self.run(vehicles[0].now_ns)

    def run(self, now_ns: int) -> None:
        """Bring all vehicles to `now_ns` and push apart what touches."""
        for vehicle in self._vehicles:
            vehicle.advance(now_ns)
        self.next_ns = self._contacts.resolve(self._vehicles)
