"""Picture check: which pictures a camera has delivered twice, or put together from two."""

from collections.abc import Iterator

import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.stars.messages import PictureTrouble, StarImage
from groundstation.star_tracking.picture_repeats import PictureRepeats


class PictureCheck(Node):
    """Looks at every picture that arrives, also at those which a busy spot finder leaves out.

    A torn picture is known by the one before it: who looks at each tenth never sees that.
    """

    inputs = (StarImage,)
    outputs = (PictureTrouble,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._repeats = PictureRepeats()

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        assert isinstance(message, StarImage)
        if message.encoding != "mono8" or len(message.data) != message.width * message.height:
            return  # the spot finder says what it is
        image = np.frombuffer(message.data, np.uint8).reshape(message.height, message.width)
        reason = self._repeats.complaint_about(image, message.stamp_ns)
        if reason:
            yield PictureTrouble(message.stamp_ns, self.vehicle, reason)
