"""Range reader: bytes of the range finder in, distances out."""

import math
from collections.abc import Iterator

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from range_finder.messages import Range, RangeBytes
from range_finder.protocol import LineParser


class RangeReader(Node):
    """Parses the lines of one device.

    Args:
        vehicle: Whose device it is.
        sigma_m: Standard deviation of a distance.
        delay_s: From a measurement to the arrival of its line.
    """

    inputs = (RangeBytes,)
    outputs = (Range,)

    def __init__(self, vehicle: str, sigma_m: float, delay_s: float) -> None:
        super().__init__(vehicle)
        self._parser = LineParser()
        self._sigma_m = sigma_m
        self._delay_ns = round(delay_s * 1e9)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, RangeBytes)
        for reading in self._parser.feed(message.data):
            yield Range(
                message.stamp_ns - self._delay_ns,
                self.vehicle,
                reading.distance_m is not None,
                math.nan if reading.distance_m is None else reading.distance_m,
                self._sigma_m,
                self._parser.lines_lost,
                self._parser.lines_refused,
            )
