"""Reference reader: the stream of truth or motion capture in, poses out."""

from collections.abc import Iterator

from drivers.reference.protocol import PoseParser
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.reference.messages import ReferenceBytes, ReferenceState


class ReferenceReader(Node):
    """Parses the stream of one vehicle."""

    inputs = (ReferenceBytes,)
    outputs = (ReferenceState,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._parser = PoseParser()

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, ReferenceBytes)
        for pose in self._parser.feed(message.data):
            if pose.is_tracked:
                yield ReferenceState(
                    pose.measured_stamp_ns(message.stamp_ns),
                    self.vehicle,
                    pose.position_table_m,
                    pose.heading_rad,
                    pose.velocity_table_m_s,
                    pose.rate_rad_s,
                )
