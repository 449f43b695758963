"""Whether what a side camera found may be another mock-up than the one it looks for.

Mock-ups are built alike, so a picture alone does not tell which of them it shows. Where each of them believes
to be does: bodies do not lie in each other, so a sighting that is nearer to another's own place than to the
leader's is of the other one. The leader's own place only decides between bodies; it moves no sighting.
"""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.sighting import Seen

Floats = NDArray[np.float64]
Vector2 = tuple[float, float]

SIGMAS = 5.0
"""How far a sighting may lie from a place beyond the bodies' own size."""
OLDEST_NS = 300_000_000
"""Between an exposure and the state of a vehicle that tells its place then: at 0.1 m/s it is 30 mm off."""


@dataclass(frozen=True, slots=True)
class KnownPlace:
    """Where a vehicle believes to be at one moment.

    Attributes:
        stamp_ns: The moment.
        position_table_m: x, y of its origin.
        heading_rad: Its heading.
        velocity_table_m_s: x, y.
        rate_rad_s: Its turn rate.
        sigma: Standard deviations of x, y (m) and heading (rad).
    """

    stamp_ns: int
    position_table_m: Vector2
    heading_rad: float
    velocity_table_m_s: Vector2
    rate_rad_s: float
    sigma: tuple[float, float, float]

    def at(self, stamp_ns: int) -> "KnownPlace":
        """The same carried to another moment."""
        span_s = (stamp_ns - self.stamp_ns) * 1e-9
        x_m, y_m = (
            p + v * span_s for p, v in zip(self.position_table_m, self.velocity_table_m_s, strict=True)
        )
        heading_rad = self.heading_rad + self.rate_rad_s * span_s
        return KnownPlace(
            stamp_ns, (x_m, y_m), heading_rad, self.velocity_table_m_s, self.rate_rad_s, self.sigma
        )


class PlaceMemory:
    """The last places of one vehicle."""

    def __init__(self) -> None:
        self._places: deque[KnownPlace] = deque()

    def remember(self, place: KnownPlace) -> None:
        """Take the next one."""
        self._places.append(place)
        while place.stamp_ns - self._places[0].stamp_ns > 2 * OLDEST_NS:
            self._places.popleft()

    def forget(self) -> None:
        """It does not know where it is."""
        self._places.clear()

    def at(self, stamp_ns: int) -> KnownPlace | None:
        """Where it was at a moment; None if nobody knows."""
        if not self._places:
            return None
        nearest = min(self._places, key=lambda place: abs(place.stamp_ns - stamp_ns))
        return nearest.at(stamp_ns) if abs(nearest.stamp_ns - stamp_ns) <= OLDEST_NS else None


def rivals_of(body: SideBody, others: Mapping[str, SideBody | None], by: str) -> dict[str, float]:
    """Which vehicles may be taken for a body, and how near to it each can come at most (m).

    By its lit part any of them: a lamp lights what is painted, whatever its file tells. By markers those that
    wear some, since three that agree are a pose.

    Args:
        body: That is looked for.
        others: The other vehicles; None where no file tells what one looks like.
        by: Row of the table of ways to look.
    """
    return {
        name: body.radius_m + (body.radius_m if other is None else other.radius_m)
        for name, other in others.items()
        if other is None or by != "markers" or other.azimuths_rad
    }


def taken_for(
    seen: Seen,
    own: KnownPlace | None,
    leader: tuple[str, float, KnownPlace | None],
    rivals: Mapping[str, tuple[float, KnownPlace | None]],
) -> str:
    """Why a sighting may be of another vehicle than the leader, or nothing.

    Args:
        seen: In the own body frame.
        own: The own place at the exposure.
        leader: Its name, the radius of its body (m), its place.
        rivals: By name, how near the two bodies can come (m), its place.
    """
    if not rivals:
        return ""
    name, radius_m, led = leader
    if own is None:
        return f"the own place is not known, which would tell {name} from {' or '.join(rivals)}"
    place, sigma_m = _in_table(seen, own)
    away_m = math.inf if led is None else math.dist(place, led.position_table_m)
    for other, (apart_m, there) in rivals.items():
        if there is None:
            if led is None or away_m > radius_m + _slack(sigma_m, led):
                return f"it may be {other}, whose own place is not known"
            continue
        off_m = math.dist(place, there.position_table_m)
        if led is None and off_m > 0.5 * apart_m + _slack(sigma_m, there):
            continue
        if off_m <= away_m:
            return f"what is seen is where {other} is, {1e3 * off_m:.0f} mm from its own place"
    return ""


def _in_table(seen: Seen, own: KnownPlace) -> tuple[Vector2, float]:
    """A sighting in the table, and the largest sigma of it there (m)."""
    cosine, sine = math.cos(own.heading_rad), math.sin(own.heading_rad)
    x_m, y_m = seen.position_body_m.tolist()
    place = (
        own.position_table_m[0] + cosine * x_m - sine * y_m,
        own.position_table_m[1] + sine * x_m + cosine * y_m,
    )
    spread_m2 = float(np.linalg.eigvalsh(seen.covariance[:2, :2])[-1])
    turned_m = seen.range_m * own.sigma[2]
    return place, math.sqrt(spread_m2 + max(own.sigma[:2]) ** 2 + turned_m**2)


def _slack(sigma_m: float, place: KnownPlace) -> float:
    return SIGMAS * math.hypot(sigma_m, *place.sigma[:2])
