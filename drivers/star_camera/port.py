"""The newest picture of the star camera, never an old one.

A thread empties the source as fast as it delivers, so that nothing queues in sockets or drivers; whoever
reads gets what came last. A consumer that is busy misses pictures, which are counted, and is never late
by more than one.
"""

import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from drivers.errors import DeviceError, LinkLost
from drivers.star_camera.camera_frame import CameraFrame
from drivers.star_camera.source import PictureSource, open_source

SILENCE_S = 2.0
_JOIN_S = 1.0


@dataclass(frozen=True, slots=True)
class CameraCounters:
    """What the port has seen since it was opened."""

    received: int
    skipped: int
    """Received but replaced by a newer picture before anybody read them."""
    refused: Mapping[str, int]
    """Arrived and were not passed on, by the reason: broken, of an unknown type, the last one again."""

    @property
    def garbled(self) -> int:
        """Refused, whatever the reason."""
        return sum(self.refused.values())


class StarCamera:
    """A camera port with newest-frame semantics; for one reading thread.

    Args:
        source: Where the pictures come from; closed with the port.
        silence_s: Without a picture for so long the link counts as lost.
    """

    def __init__(self, source: PictureSource, silence_s: float = SILENCE_S) -> None:
        self.name = source.name
        self._source = source
        self._silence_s = silence_s
        self._news = threading.Condition()
        self._newest: CameraFrame | None = None
        self._error: LinkLost | None = None
        self._received_s = time.monotonic()
        self._received = 0
        self._read = 0
        self._is_closed = False
        self._thread = threading.Thread(
            target=self._empty_source, name=f"star camera {source.name}", daemon=True
        )
        self._thread.start()

    @classmethod
    def open(
        cls,
        address: int | str,
        *,
        silence_s: float = SILENCE_S,
        rate_hz: float = 15.0,
        is_colour: bool = False,
    ) -> Self:
        """Open a device index or path, a URL, or a folder of PNG files (read at `rate_hz`).

        With `is_colour` frames are blue-green-red and grey pictures count as garbled.

        Raises:
            NotFound: It cannot be opened.
        """
        return cls(open_source(address, timeout_s=silence_s, rate_hz=rate_hz, is_colour=is_colour), silence_s)

    @property
    def counters(self) -> CameraCounters:
        """Counts up to now."""
        with self._news:
            unread = self._newest is not None
            skipped = self._received - self._read - unread
            return CameraCounters(self._received, skipped, self._source.refusals.counts)

    def read(self, timeout_s: float | None = None) -> CameraFrame | None:
        """The newest picture that has not been read yet; waits for one.

        Args:
            timeout_s: How long to wait; None waits until there is a picture or the link is lost.

        Returns:
            The picture, or None if none came within `timeout_s`.

        Raises:
            LinkLost: The source ended, went away, was silent for `silence_s`, or the port is closed.
                Opening anew is up to the caller.
        """
        give_up_s = None if timeout_s is None else time.monotonic() + timeout_s
        with self._news:
            while (frame := self._take_newest()) is None:
                if self._error is not None:
                    raise LinkLost(str(self._error)) from self._error
                now_s = time.monotonic()
                silent_at_s = self._received_s + self._silence_s
                if now_s >= silent_at_s:
                    refused = self._source.refusals.in_words()
                    raise LinkLost(
                        f"star camera {self.name} has sent no picture for {self._silence_s:g} s"
                        + (f"; refused so far: {refused}" if refused else "")
                    )
                if give_up_s is not None and now_s >= give_up_s:
                    return None
                self._news.wait((silent_at_s if give_up_s is None else min(silent_at_s, give_up_s)) - now_s)
            return frame

    def close(self) -> None:
        """Release the source and end the thread; may be called twice."""
        with self._news:
            if self._is_closed:
                return
            self._is_closed = True
            self._newest = None
            self._error = LinkLost(f"star camera {self.name} is closed")
            self._news.notify_all()
        self._source.close()
        self._thread.join(_JOIN_S)  # a device that hangs in its driver keeps its daemon thread

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _take_newest(self) -> CameraFrame | None:
        frame, self._newest = self._newest, None
        if frame is None or time.monotonic_ns() - frame.stamp_arrival_ns > self._silence_s * 1e9:
            return None  # the last picture of a dead link is an old one
        self._read += 1
        return frame

    def _empty_source(self) -> None:
        error = LinkLost(f"star camera {self.name} is lost")
        try:
            while not self._is_closed:
                picture = self._source.read()
                with self._news:
                    number = self._received if picture.sequence is None else picture.sequence
                    self._newest = CameraFrame(
                        picture.image, picture.stamp_arrival_ns, number, picture.stamp_device_ns
                    )
                    self._received += 1
                    self._received_s = time.monotonic()
                    self._news.notify_all()
        except LinkLost as lost:
            error = lost
        except DeviceError as failed:
            error = LinkLost(str(failed))
        finally:  # whatever ended the thread, the reader must learn of it
            with self._news:
                self._error = self._error or error
                self._news.notify_all()
