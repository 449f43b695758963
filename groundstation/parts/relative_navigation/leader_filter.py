"""Leader filter: sightings of the side camera and the own state in, the leader's motion out."""

import math
from collections.abc import Iterator

import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.fusion.state_memory import StateMemory
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.relative_navigation.messages import LeaderState, RelativePose
from groundstation.parts.relative_navigation.own_way import OwnWay
from groundstation.relative_navigation.relative_filter import RelativeFilter


class LeaderFilter(Node):
    """Publishes the leader's motion whenever a sighting was believed; silent while it is not seen.

    Args:
        vehicle: Its name.
        seen: Of the mock-up that the side camera looks for.
    """

    inputs = (RelativePose, VehicleState)
    outputs = (LeaderState,)

    def __init__(self, vehicle: str, seen: str) -> None:
        super().__init__(vehicle)
        self._seen = seen
        self._memory: StateMemory[VehicleState] = StateMemory()
        self._way = OwnWay()
        self._newest: VehicleState | None = None
        self._filter = RelativeFilter()

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        match message:
            case VehicleState():
                self._memory.remember(message)
                self._way.remember(message)
                self._newest = message if message.status == "flying" else None
            case RelativePose(status="solved"):
                yield from self._take(message)

    def _take(self, pose: RelativePose) -> Iterator[Message]:
        then = self._memory.at(pose.stamp_ns)
        newest = self._newest
        if then is None or newest is None or newest.stamp_ns < pose.stamp_ns:
            return
        refusal = self._filter.take(
            self._way.moment(then),
            np.array(pose.position_body_m),
            pose.relative_heading_rad,
            np.array(pose.covariance).reshape(3, 3),
            pose.stamp_sigma_s,
        )
        if refusal:
            return
        found = self._filter.at(self._way.moment(newest))
        if found is None:
            return
        x_m, y_m = (np.array(newest.position_table_m) + found.away_table_m).tolist()
        vx_m_s, vy_m_s = found.velocity_table_m_s.tolist()
        sigma = np.sqrt(np.diag(found.covariance))
        heading_sigma = math.inf if math.isnan(found.heading_rad) else float(sigma[4])
        yield LeaderState(
            newest.stamp_ns,
            self.vehicle,
            self._seen,
            (x_m, y_m),
            found.heading_rad,
            (vx_m_s, vy_m_s),
            found.rate_rad_s,
            (float(sigma[0]), float(sigma[1]), heading_sigma),
            pose.stamp_ns,
        )
