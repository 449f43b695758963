"""Picture keeper: holds the last frames, and publishes those that the star tracker reports on."""

from collections import deque
from collections.abc import Iterator

import cv2
import numpy as np

from groundstation.declarations.message import Message
from groundstation.declarations.node import Node
from groundstation.parts.stars.messages import StarImage, StarMatches, StarPicture

MEMORY_NS = 3_000_000_000
MOST_FRAMES = 16  # a second: the star tracker answers within less, and frames are large
_FASTEST = (cv2.IMWRITE_PNG_COMPRESSION, 1)


class PictureKeeper(Node):
    """Adds the picture to every ``StarMatches``, without loss, so that it can be solved again.

    It is no part of the way from light to fix: a picture of 640 x 480 takes some 10 ms to compress, and
    the star tracker chooses at most one a second. A frame that is no longer held is not reported.
    """

    inputs = (StarImage, StarMatches)
    outputs = (StarPicture,)

    def __init__(self, vehicle: str) -> None:
        super().__init__(vehicle)
        self._frames: deque[StarImage] = deque(maxlen=MOST_FRAMES)

    def receive(self, message: Message, now_ns: int) -> Iterator[Message]:
        del now_ns
        match message:
            case StarImage():
                self._frames.append(message)
                while message.stamp_ns - self._frames[0].stamp_ns > MEMORY_NS:
                    self._frames.popleft()
            case StarMatches():
                frame = next((f for f in reversed(self._frames) if f.stamp_ns == message.stamp_ns), None)
                if frame is not None:
                    image = np.frombuffer(frame.data, np.uint8).reshape(frame.height, frame.width)
                    _, data = cv2.imencode(".png", image, _FASTEST)
                    yield StarPicture(frame.stamp_ns, self.vehicle, "png", data.tobytes())
