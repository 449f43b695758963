"""Whether a mock-up can still stop inside its part of the table.

On a table without friction closed valves mean coasting, so what counts is not where the mock-up is but where
it will be when full braking has stopped it: braking along the velocity at a, it comes nearer to an edge by
vn t + vn |v| / (2 a), with vn the speed towards that edge and t the time until the valves push.
"""

import enum
import math
from typing import NamedTuple

from groundstation.control.keep_in import KeepIn
from groundstation.control.state import ControlState
from groundstation.control.vehicle import VehicleModel
from groundstation.control.wrench_envelope import WrenchEnvelope

RELIED_ON = 0.9
"""Of the nominal thrust: spread and sag of the valves."""
SLOPE_M_S2 = 0.005
"""A table half a milliradian off level."""
_SLOWEST_BRAKING_M_S2 = 1e-6  # a division guard: with no authority every motion is too late


class EdgeVerdict(enum.Enum):
    """What the edge asks for."""

    CLEAR = "clear"
    BRAKE = "brake now to stop inside"
    TOO_LATE = "braking ends outside: cut the float air"


class EdgeOutlook(NamedTuple):
    """Prediction for the edge that is met first.

    Attributes:
        verdict: What to do.
        room_m: Distance to the edge that is left after stopping; negative outside.
        stopping_distance_m: Length of the way to rest, reaction included.
        time_to_edge_s: When coasting crosses the first edge; infinite when it never does.
    """

    verdict: EdgeVerdict
    room_m: float
    stopping_distance_m: float
    time_to_edge_s: float


def braking_to_count_on(model: VehicleModel, envelope: WrenchEnvelope) -> float:
    """Deceleration (m/s^2) that the valves give in whatever direction it is needed; at least 0."""
    return max(0.0, RELIED_ON * envelope.max_force_n / model.mass_kg - SLOPE_M_S2)


def edge_outlook(
    state: ControlState,
    keep_in: KeepIn,
    braking_m_s2: float,
    *,
    reaction_s: float,
    reserve_m: float = 0.05,
) -> EdgeOutlook:
    """Whether the mock-up must brake now.

    Args:
        state: Newest estimate.
        keep_in: Region whose edge must not be crossed.
        braking_m_s2: Deceleration to count on: the weakest direction's force over mass, less the slope.
        reaction_s: Age of the state plus the time until the valves push.
        reserve_m: Room after stopping below which braking is asked for, above it all is clear.
    """
    velocity = state.velocity_table_m_s
    speed = math.hypot(*velocity)
    stopping_s = reaction_s + speed / (2.0 * max(braking_m_s2, _SLOWEST_BRAKING_M_S2))
    room_m, time_to_edge_s = math.inf, math.inf
    distances = keep_in.edge_distances_m(state.position_table_m)
    for (normal, _), distance in zip(keep_in.inward(), distances, strict=True):
        approach = -(normal[0] * velocity[0] + normal[1] * velocity[1])
        if approach <= 0.0:
            continue  # leaving or along: outside already, it is on its way back
        room_m = min(room_m, distance - approach * stopping_s)
        time_to_edge_s = min(time_to_edge_s, max(0.0, distance) / approach)
    if room_m >= reserve_m:
        verdict = EdgeVerdict.CLEAR
    else:
        verdict = EdgeVerdict.BRAKE if room_m >= 0.0 else EdgeVerdict.TOO_LATE
    return EdgeOutlook(verdict, room_m, speed * stopping_s, time_to_edge_s)
