"""Fix reader: an external pose stream that stands in for the star tracker."""

from collections.abc import Iterator

from drivers.reference.protocol import PoseParser
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.frames import wrap_angle
from groundstation.parts.stars.messages import FixBytes, StarFix


class FixReader(Node):
    """Turns the poses of a stream into fixes of mode ``external``.

    Args:
        vehicle: Its name.
        stamp_sigma_s: Standard deviation of the stream's ages.
    """

    inputs = (FixBytes,)
    outputs = (StarFix,)

    def __init__(self, vehicle: str, stamp_sigma_s: float) -> None:
        super().__init__(vehicle)
        self._parser = PoseParser()
        self._stamp_sigma_s = stamp_sigma_s

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        assert isinstance(message, FixBytes)
        for pose in self._parser.feed(message.data):
            yield StarFix(
                pose.measured_stamp_ns(message.stamp_ns),
                self.vehicle,
                pose.is_tracked,
                *pose.position_table_m,
                wrap_angle(pose.heading_rad),
                tuple(pose.covariance_matrix().ravel().tolist()),
                self._stamp_sigma_s,
                0,
                "external",
                "" if pose.is_tracked else "the source lost the vehicle",
            )
