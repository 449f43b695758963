"""Fix reader: an external pose stream that stands in for the star tracker."""

import math
from collections.abc import Iterator

from drivers.reference.protocol import PoseParser
from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.frames import wrap_angle
from groundstation.fusion.hold_up import HoldUp
from groundstation.parts.imu.messages import Imu
from groundstation.parts.stars.messages import FixBytes, StarFix


class FixReader(Node):
    """Turns the poses of a stream into fixes of mode ``external``.

    Poses are stamped by their arrival: where IMU samples of the same moment are held up, so were they.

    Args:
        vehicle: Its name.
        stamp_sigma_s: Standard deviation of the stream's ages.
        spread_s: Of the lateness of IMU samples on a quiet machine.
    """

    inputs = (FixBytes, Imu)
    outputs = (StarFix,)

    def __init__(self, vehicle: str, stamp_sigma_s: float, spread_s: float) -> None:
        super().__init__(vehicle)
        self._parser = PoseParser()
        self._stamp_sigma_s = stamp_sigma_s
        self._hold_up = HoldUp(spread_s)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        if isinstance(message, Imu):
            self._hold_up.sample(now_ns, message.stamp_ns)
            return
        assert isinstance(message, FixBytes)
        held_up_s = self._hold_up.excess_s(now_ns)
        for pose in self._parser.feed(message.data):
            doubt_s = 0.0 if pose.is_host_clock else held_up_s
            yield StarFix(
                pose.measured_stamp_ns(message.stamp_ns),
                self.vehicle,
                pose.is_tracked,
                *pose.position_table_m,
                wrap_angle(pose.heading_rad),
                tuple(pose.covariance_matrix().ravel().tolist()),
                math.hypot(self._stamp_sigma_s, doubt_s),
                0,
                "external",
                "" if pose.is_tracked else "the source lost the vehicle",
            )
