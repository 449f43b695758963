"""What becomes of a formation when a ship has come down: who moves up, and on which ways.

Every ship answers this by itself, from what all of them know alike: the places, who had which, and where the
fallen one lies. That is an estimate, so it is rounded to a raster and its obstacle made larger by that.
"""

import math
from collections.abc import Mapping

from groundstation.control.assignment import reassigned
from groundstation.control.keep_in import KeepIn
from groundstation.control.planning import straight_or_planned
from groundstation.control.state import Vector2
from groundstation.control.trajectories import NoSafeWayError, Plan, Reconfiguration
from groundstation.control.trajectory_config import TrajectoryConfig

RASTER_M = 0.05


def moved_up(
    config: TrajectoryConfig,
    keep_in: KeepIn | None,
    assigned: Mapping[str, int],
    fallen_m: Mapping[str, Vector2],
) -> tuple[dict[str, int], Plan] | None:
    """Places and ways of the ships that are left, by the rule `empty` of their reconfiguration.

    Args:
        config: What was asked for.
        keep_in: Region for the centres.
        assigned: Number of each ship's place until now; all of them are there.
        fallen_m: Where each ship lies that has come down, table frame; of others, too.

    Returns:
        None where nobody moves: by rule, because no place is free, or because no way there is safe.
    """
    margins = config.margins()
    apart_m = 2.0 * margins.radius_m + margins.gap_m
    lie_m = {name: _on_raster(place_m) for name, place_m in fallen_m.items()}
    blocked = [
        number
        for number, place_m in enumerate(config.places_m)
        if any(math.dist(place_m, lies_m) < apart_m + RASTER_M for lies_m in lie_m.values())
    ]
    chosen = reassigned(assigned, tuple(fallen_m), config.places_m, config.empty, blocked=blocked)
    if all(assigned[name] == number for name, number in chosen.items()):
        return None
    asked = Reconfiguration(
        tuple(config.places_m[assigned[name]] for name in chosen),
        tuple(config.places_m[number] for number in chosen.values()),
        keep_in,
        (*config.obstacles_m, *((x, y, margins.radius_m + RASTER_M) for x, y in lie_m.values())),
        margins,
    )
    try:
        return chosen, straight_or_planned(asked)
    except NoSafeWayError:
        return None


def _on_raster(place_m: Vector2) -> Vector2:
    x, y = (RASTER_M * round(value / RASTER_M) for value in place_m)
    return x, y
