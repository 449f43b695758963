"""Who goes to which place: the choice that costs least over all ships together.

The linear sum assignment (H. W. Kuhn, The Hungarian Method for the Assignment Problem, Naval Research
Logistics Quarterly 2, 1955; scipy solves it as in D. F. Crouse, On Implementing 2D Rectangular Assignment
Algorithms, IEEE Trans. Aerosp. Electron. Syst. 52(4), 2016). The least sum of squared distances has a virtue
of its own: straight ways flown at one pace cannot cross (M. Turpin, N. Michael, V. Kumar, CAPT: Concurrent
Assignment and Planning of Trajectories for Multiple Robots, Int. J. Robotics Research 33(1), 2014).
"""

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from groundstation.control.state import Vector2

Cost = Literal["squared_distance", "time"]
Rule = Literal["fill", "keep"]
_USUAL_SPEED_M_S, _USUAL_ACCELERATION_M_S2 = 0.10, 0.020  # of `go_to`


def assign(
    ships_m: Mapping[str, Vector2],
    places_m: Sequence[Vector2],
    cost: Cost = "squared_distance",
    *,
    speed_m_s: float = _USUAL_SPEED_M_S,
    acceleration_m_s2: float = _USUAL_ACCELERATION_M_S2,
) -> dict[str, int]:
    """The number of each ship's place, for the least sum of costs.

    Args:
        ships_m: Where each ship is, table frame.
        places_m: Where they are to be; places that are left over stay empty.
        cost: Squared length of the way, or the time that it takes from rest to rest.
        speed_m_s: Largest speed, for the time.
        acceleration_m_s2: Largest acceleration, for the time.

    Raises:
        ValueError: There are fewer places than ships, or a number is not finite.
    """
    if len(places_m) < len(ships_m):
        raise ValueError(f"{len(ships_m)} ships need as many places, found {len(places_m)}: give more places")
    if not ships_m:
        return {}
    ways_m = np.array(
        [[math.dist(ship_m, place_m) for place_m in places_m] for ship_m in ships_m.values()], dtype=float
    )
    if not np.isfinite(ways_m).all():
        raise ValueError("ships and places must be at finite positions")
    costs = ways_m**2 if cost == "squared_distance" else _times_s(ways_m, speed_m_s, acceleration_m_s2)
    _, columns = linear_sum_assignment(costs)
    return dict(zip(ships_m, columns.tolist(), strict=True))


def reassigned(
    assigned: Mapping[str, int],
    absent: Sequence[str],
    places_m: Sequence[Vector2],
    rule: Rule,
    *,
    blocked: Collection[int] = (),
) -> dict[str, int]:
    """Places of those that are left after some ships have fallen out.

    Args:
        assigned: Number of each ship's place until now.
        absent: Who has fallen out.
        places_m: The places, those that matter most first.
        rule: ``keep``: everybody stays and the place is empty. ``fill``: the first places are filled, at the
            least sum of squared distances, so that the last ones fall empty.
        blocked: Numbers of places nobody else can have, since somebody lies there.
    """
    left = {ship: place for ship, place in assigned.items() if ship not in absent}
    if rule == "keep":
        return left
    taken = set(blocked) - set(left.values())
    free = [number for number in range(len(places_m)) if number not in taken][: len(left)]
    if len(free) < len(left):
        return left
    found = assign(
        {ship: places_m[place] for ship, place in left.items()}, [places_m[number] for number in free]
    )
    return {ship: free[number] for ship, number in found.items()}


def _times_s(ways_m: NDArray[np.float64], speed_m_s: float, acceleration_m_s2: float) -> NDArray[np.float64]:
    """From rest to rest: a trapezoid of speed, or a triangle where the way is too short for it."""
    if not (speed_m_s > 0.0 and acceleration_m_s2 > 0.0):
        raise ValueError(f"speed and acceleration must be above 0, found {speed_m_s}, {acceleration_m_s2}")
    ramps_m = speed_m_s**2 / acceleration_m_s2
    long_s = ways_m / speed_m_s + speed_m_s / acceleration_m_s2
    times_s: NDArray[np.float64] = np.where(
        ways_m >= ramps_m, long_s, 2.0 * np.sqrt(ways_m / acceleration_m_s2)
    )
    return times_s
