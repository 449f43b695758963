"""Where the vehicles of a rig believe to be, so that a sighting of another one is told from the leader's."""

from collections.abc import Mapping

from groundstation.parts.fusion.messages import VehicleState
from groundstation.relative_navigation.rivals import KnownPlace, PlaceMemory, taken_for
from groundstation.relative_navigation.side_bodies import SideBody
from groundstation.relative_navigation.sighting import Seen

KNOWN_PLACES = frozenset({"flying", "resting"})
"""Of the states of an estimator: those in which its place means something."""


class WhoIsWhere:
    """Remembers the places of all that a sighting may be of.

    Args:
        vehicle: That carries the camera.
        body: Whom it looks for.
        rivals: Other vehicles that may be taken for it, and how near the two bodies can come (m).
    """

    def __init__(self, vehicle: str, body: SideBody, rivals: Mapping[str, float]) -> None:
        self._vehicle, self._body, self._rivals = vehicle, body, dict(rivals)
        self._places = {name: PlaceMemory() for name in (vehicle, body.vehicle, *rivals)} if rivals else {}

    @property
    def vehicles(self) -> tuple[str, ...]:
        """Whose states it wants; none where nobody can be taken for the leader."""
        return tuple(self._places)

    def remember(self, state: VehicleState) -> None:
        """Take the next state of one of them."""
        memory = self._places[state.vehicle]
        if state.status not in KNOWN_PLACES:
            memory.forget()
            return
        memory.remember(
            KnownPlace(
                state.stamp_ns,
                state.position_table_m,
                state.heading_rad,
                state.velocity_table_m_s,
                state.rate_rad_s,
                state.pose_sigma,
            )
        )

    def objection(self, seen: Seen, stamp_ns: int) -> str:
        """Why a sighting at a moment may be of another vehicle; empty if none is."""
        known = {name: memory.at(stamp_ns) for name, memory in self._places.items()}
        leader = self._body.vehicle
        return taken_for(
            seen,
            known.get(self._vehicle),
            (leader, self._body.radius_m, known.get(leader)),
            {name: (apart_m, known[name]) for name, apart_m in self._rivals.items()},
        )
