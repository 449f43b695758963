"""Where pictures come from: a video device, a stream, a folder; one row per kind of address.

A source blocks until its next picture is there. Nobody but `port.StarCamera` should read one, since a
slow reader would see pictures that are seconds old.
"""

import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from drivers.errors import LinkLost, NotFound
from drivers.star_camera.device_stamp import SenderClock, offset_utc_ns
from drivers.star_camera.http_stream import HttpStream
from drivers.star_camera.picture import decode_picture, to_colour, to_mono
from drivers.star_camera.refusals import PictureRefused, Refusals


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A picture, when its last byte was read, and its number and stamp where the sender gives them."""

    image: NDArray[np.uint8]
    stamp_arrival_ns: int
    sequence: int | None = None
    stamp_device_ns: int | None = None


class PictureSource(Protocol):
    """Pictures one after the other."""

    name: str
    refusals: Refusals
    """Pictures that came and were not passed on."""

    def read(self) -> Picture:
        """Block until the next whole picture is there.

        Raises:
            LinkLost: The source ended, went away or fell silent.
        """
        ...

    def close(self) -> None:
        """Release the source; a `read` in another thread ends with LinkLost."""
        ...


class HttpSource:
    """A multipart stream over HTTP: raw mono8 or bgr8, JPEG or PNG parts. No proxy, no redirection.

    A picture with the number or the stamp of the one before is that one again: it is refused as frozen.

    Raises:
        NotFound: Nobody serves a multipart stream there.
    """

    def __init__(self, url: str, timeout_s: float, *, is_colour: bool = False) -> None:
        self.name = url
        self.refusals = Refusals()
        self._is_colour = is_colour
        self._timeout_s = timeout_s
        self._ready: deque[Picture] = deque()
        self._stream = HttpStream(url, timeout_s)
        self._clock = SenderClock()
        self._last = ("", "")

    def read(self) -> Picture:
        """The next whole picture; those that cannot be used are counted and passed over."""
        deadline_s = time.monotonic() + self._timeout_s
        before = self.refusals.total
        while not self._ready:
            try:
                parts = self._stream.read(deadline_s)
            except TimeoutError as error:
                refused = self.refusals.in_words() if self.refusals.total > before else ""
                raise LinkLost(
                    f"star camera {self.name} sends no picture for {self._timeout_s:g} s"
                    + (f"; refused: {refused}" if refused else "")
                ) from error
            except OSError as error:
                raise LinkLost(f"star camera {self.name} is lost: {error}") from error
            stamp_ns = time.monotonic_ns()
            for part in parts:
                self._take(part.headers, part.body, stamp_ns)
            if not parts and self._stream.has_ended and not self._ready:
                raise LinkLost(f"star camera {self.name} ended its stream")
        return self._ready.popleft()

    def close(self) -> None:
        """Shut the socket down, which wakes a reader."""
        self._stream.close()

    def _take(self, headers: dict[str, str], body: bytes, arrival_ns: int) -> None:
        try:
            self._refuse_repetition(headers.get("x-sequence", ""), headers.get("x-timestamp", ""))
            image = decode_picture(headers, body, is_colour=self._is_colour)
        except PictureRefused as refused:
            self.refusals.count(refused.kind)
            return
        sequence = headers.get("x-sequence", "")
        number = int(sequence) if sequence.isdecimal() and len(sequence) < 19 else None
        device_ns = None
        if self._stream.is_of_this_host:
            with suppress(ValueError):  # no header, or no number in it: the arrival has to do
                stamp_s = float(headers.get("x-timestamp", ""))
                device_ns = self._clock.stamp_ns(stamp_s, arrival_ns, offset_utc_ns())
        self._ready.append(Picture(image, arrival_ns, number, device_ns))

    def _refuse_repetition(self, number: str, stamp: str) -> None:
        last_number, last_stamp = self._last
        self._last = (number, stamp)
        if number and number == last_number:
            raise PictureRefused("frozen: its X-Sequence repeats")
        if "." in stamp and stamp == last_stamp:  # whole seconds are the same in several pictures
            raise PictureRefused("frozen: its X-Timestamp repeats")


class VideoSource:
    """What OpenCV can capture: a device index, a device path, a stream such as rtsp.

    Raises:
        NotFound: It cannot be opened.
    """

    def __init__(self, address: int | str, timeout_s: float, *, is_colour: bool = False) -> None:
        self._convert = to_colour if is_colour else to_mono
        self.name = f"video {address}"
        self.refusals = Refusals()
        self._clock = SenderClock()
        self._last_ns: int | None = None
        self._reading = threading.Lock()
        limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(timeout_s * 1e3)]
        limits += [cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(timeout_s * 1e3)]
        is_url = isinstance(address, str) and "://" in address
        self._capture = (
            cv2.VideoCapture(str(address), cv2.CAP_FFMPEG, limits) if is_url else cv2.VideoCapture(address)
        )
        if not self._capture.isOpened():
            raise NotFound(f"star camera {self.name} cannot be opened")

    def read(self) -> Picture:
        """The next picture of the device."""
        while True:
            with self._reading:
                is_there, image = self._capture.read()
                stamp_ns = time.monotonic_ns()
                # V4L2's stamp of the buffer; other back ends tell the place in the stream, which is no stamp
                device_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) * 1e-3
            if not is_there:
                raise LinkLost(f"star camera {self.name} gives no more pictures")
            device_ns = None
            if device_s > 0.0:
                device_ns = self._clock.stamp_ns(device_s, stamp_ns, offset_utc_ns())
            last_ns, self._last_ns = self._last_ns, device_ns
            try:
                if device_ns is not None and device_ns == last_ns:
                    raise PictureRefused("frozen: its driver's stamp repeats")
                return Picture(self._convert(image), stamp_ns, None, device_ns)
            except PictureRefused as refused:
                self.refusals.count(refused.kind)

    def close(self) -> None:
        """Release the device, once a reader has its picture."""
        with self._reading:
            self._capture.release()


class FolderSource:
    """The PNG files of a folder in the order of their names, at a rate, then the end.

    Raises:
        NotFound: The folder is not there or holds no PNG file.
    """

    def __init__(self, folder: Path, rate_hz: float, *, is_colour: bool = False) -> None:
        self.name = str(folder)
        self._is_colour = is_colour
        self.refusals = Refusals()
        self._closing = threading.Event()
        self._files = sorted(folder.glob("*.png"))
        if not self._files:
            raise NotFound(f"star camera folder {folder} holds no PNG file")
        self._period_s = 1.0 / rate_hz
        self._next = 0
        self._start_s: float | None = None

    def read(self) -> Picture:
        """The next file, not before its time."""
        while self._next < len(self._files):
            number, self._next = self._next, self._next + 1
            now_s = time.monotonic()
            self._start_s = now_s if self._start_s is None else self._start_s
            if self._closing.wait(max(0.0, self._start_s + number * self._period_s - now_s)):
                raise LinkLost(f"star camera folder {self.name} is closed")
            try:
                body = self._files[number].read_bytes()
                image = decode_picture({"content-type": "image/png"}, body, is_colour=self._is_colour)
            except PictureRefused as refused:
                self.refusals.count(refused.kind)
                continue
            except OSError as error:
                raise LinkLost(f"star camera folder {self.name} is lost: {error}") from error
            return Picture(image, time.monotonic_ns(), number)
        raise LinkLost(f"star camera folder {self.name} has no more pictures")

    def close(self) -> None:
        """End the wait of a reader."""
        self._closing.set()


def open_source(
    address: int | str, *, timeout_s: float, rate_hz: float, is_colour: bool = False
) -> PictureSource:
    """Open what an address of a rig file means.

    Args:
        address: A device index (`0` or `"0"`), a device path, an http URL (multipart stream), any other URL
            that OpenCV takes, or a folder of PNG files.
        timeout_s: How long opening and each picture may take.
        rate_hz: Pictures per second of a folder.
        is_colour: Pictures in colour instead of grey.

    Raises:
        NotFound: It cannot be opened.
    """
    if isinstance(address, str) and address.isdecimal():
        address = int(address)
    if isinstance(address, int):
        return VideoSource(address, timeout_s, is_colour=is_colour)
    if address.startswith("http://"):
        return HttpSource(address, timeout_s, is_colour=is_colour)
    if Path(address).is_dir():
        return FolderSource(Path(address), rate_hz, is_colour=is_colour)
    return VideoSource(address, timeout_s, is_colour=is_colour)
