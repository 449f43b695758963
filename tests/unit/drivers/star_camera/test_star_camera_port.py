"""The port of a star camera: the newest picture, its stamp, its end; folders and video files."""

import threading
import time

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from unit.drivers.star_camera.picture_server import PATIENCE_S, Script, picture, raw_part, serve

from drivers.errors import LinkLost, NotFound
from drivers.star_camera.device_stamp import SenderClock
from drivers.star_camera.port import StarCamera
from drivers.star_camera.refusals import Refusals
from drivers.star_camera.source import FolderSource, Picture, VideoSource


class Hand:
    """A source that a test feeds picture by picture."""

    def __init__(self):
        self.name, self.refusals, self.is_closed = "by hand", Refusals(), False
        self._given, self._asked = threading.Semaphore(0), threading.Semaphore(0)
        self._next, self.age_ns = [], 0

    def give(self, *pictures):
        """Return when the port has taken all of them and asks for more."""
        for item in pictures:
            self._asked.acquire()
            self._next.append(item)
            self._given.release()
        self._asked.acquire()
        self._asked.release()

    def read(self):
        self._asked.release()
        self._given.acquire()
        if self.is_closed:
            raise LinkLost("closed")
        item = self._next.pop(0)
        if isinstance(item, Exception):
            raise item
        return Picture(picture(item), time.monotonic_ns() - self.age_ns)

    def close(self):
        self.is_closed = True
        self._given.release()


def test_a_slow_consumer_sees_the_newest_picture_only():
    hand = Hand()
    with StarCamera(hand) as camera:
        hand.give(1, 2, 3, 4, 5)
        frame = camera.read()
        assert (frame.image[0, 0], frame.sequence) == (5, 4)
        assert camera.read(timeout_s=0.0) is None
        hand.give(6)
        assert camera.read().image[0, 0] == 6
        assert (camera.counters.received, camera.counters.skipped) == (6, 4)


def test_a_picture_is_read_once_and_its_stamp_is_its_arrival():
    hand = Hand()
    with StarCamera(hand) as camera:
        before_ns = time.monotonic_ns()
        hand.give(1)
        frame = camera.read()
        assert before_ns <= frame.stamp_arrival_ns <= time.monotonic_ns()


@pytest.mark.parametrize("clock_s", [time.monotonic, time.time])
def test_a_stamp_of_a_server_on_this_host_counts_instead_of_the_arrival(clock_s):
    ready = threading.Event()
    taken_ns, reported_s = time.monotonic_ns() - 500_000_000, clock_s() - 0.5
    part = raw_part(picture(7), 0, f"X-Timestamp: {reported_s:.6f}")
    with serve(Script(part, ready)) as url, StarCamera.open(url) as camera:
        frame = camera.read(PATIENCE_S)
        assert abs(frame.stamp_ns - taken_ns) < 10_000_000  # two clocks read one after the other
        assert frame.stamp_arrival_ns - taken_ns >= 500_000_000
        ready.set()


@pytest.mark.parametrize(
    "header", ["X-Timestamp: soon", "X-Timestamp: 12.5", "X-Timestamp: nan", "X-Other: 1"]
)
def test_without_a_believable_stamp_the_arrival_counts(header):
    ready = threading.Event()
    with serve(Script(raw_part(picture(7), 0, header), ready)) as url, StarCamera.open(url) as camera:
        frame = camera.read(PATIENCE_S)
        assert frame.stamp_device_ns is None
        assert frame.stamp_ns == frame.stamp_arrival_ns
        ready.set()


@given(
    age_ns=st.integers(-(10**10), 10**14),
    arrival_ns=st.integers(10**14, 10**15),
    offset_ns=st.integers(10**18, 2 * 10**18),
    is_utc=st.booleans(),
)
def test_a_stamp_is_believed_on_either_clock_while_no_other_clock_could_have_made_it(
    age_ns, arrival_ns, offset_ns, is_utc
):
    reported_ns = arrival_ns - age_ns + offset_ns * is_utc
    found_ns = SenderClock().stamp_ns(reported_ns * 1e-9, arrival_ns, offset_ns)
    blur_ns = 1000  # of UTC seconds in a float
    oldest_ns = (86_400 if is_utc else 60) * 1_000_000_000
    if blur_ns < age_ns < oldest_ns - blur_ns:
        assert abs(found_ns - (arrival_ns - age_ns)) <= blur_ns
    elif not -blur_ns <= age_ns <= oldest_ns + blur_ns:
        assert found_ns is None


@pytest.mark.parametrize("is_utc", [False, True])
@pytest.mark.parametrize("age_s", [0.5, 3.0, 61.0, 4_000.0, 90_000.0])
def test_once_the_clock_is_known_an_old_stamp_stays_old(is_utc, age_s):
    clock, now_ns, offset_ns = SenderClock(), 10**14, 1_700_000_000 * 10**9
    shift_s = offset_ns * 1e-9 * is_utc
    assert clock.stamp_ns(now_ns * 1e-9 - 0.1 + shift_s, now_ns, offset_ns) == pytest.approx(
        now_ns - 10**8, abs=1000
    )
    found_ns = clock.stamp_ns(now_ns * 1e-9 - age_s + shift_s, now_ns, offset_ns)
    assert (now_ns - found_ns) * 1e-9 == pytest.approx(age_s, abs=1e-6)
    assert clock.stamp_ns(now_ns * 1e-9 + 5.0 + shift_s, now_ns, offset_ns) is None


def test_a_silent_source_is_a_lost_link():
    hand = Hand()
    with StarCamera(hand, silence_s=0.05) as camera, pytest.raises(LinkLost, match=r"no picture for 0\.05 s"):
        camera.read()


def test_the_last_picture_of_a_dead_link_is_not_shown_when_it_is_old():
    hand = Hand()
    hand.age_ns = 3_000_000_000
    with StarCamera(hand) as camera:
        hand.give(1)
        assert camera.read(timeout_s=0.0) is None
        assert (camera.counters.received, camera.counters.skipped) == (1, 1)


def test_what_ends_the_source_reaches_the_reader_after_the_last_picture():
    hand = Hand()
    with StarCamera(hand) as camera:
        hand.give(1)
        camera.read()
        hand._asked.acquire()
        hand._next.append(LinkLost("the cable is out"))
        hand._given.release()
        for _ in range(2):
            with pytest.raises(LinkLost, match="the cable is out"):
                camera.read()


def test_closing_ends_a_waiting_reader_and_the_thread():
    hand = Hand()
    camera = StarCamera(hand)
    told = []

    def wait_for_a_picture():
        with pytest.raises(LinkLost, match="closed"):
            camera.read()
        told.append(True)

    reader = threading.Thread(target=wait_for_a_picture)
    reader.start()
    camera.close()
    camera.close()
    reader.join()
    assert told == [True]
    assert not camera._thread.is_alive()


def test_a_folder_plays_its_files_in_order_and_ends(tmp_path):
    for number in (2, 1, 3):
        cv2.imwrite(str(tmp_path / f"{number:05d}.png"), picture(number))
    (tmp_path / "00002b.png").write_bytes(b"no picture")
    source = FolderSource(tmp_path, rate_hz=10_000.0)
    assert [source.read().image[0, 0] for _ in range(3)] == [1, 2, 3]
    assert source.refusals.total == 1
    with pytest.raises(LinkLost, match="no more pictures"):
        source.read()


def test_a_folder_is_opened_by_its_path_and_closed_while_it_waits(tmp_path):
    for number in range(2):
        cv2.imwrite(str(tmp_path / f"{number}.png"), picture(number))
    with StarCamera.open(str(tmp_path), rate_hz=0.01, silence_s=PATIENCE_S) as camera:
        assert camera.read().image[0, 0] == 0


def test_an_empty_folder_is_not_found(tmp_path):
    with pytest.raises(NotFound, match="no PNG"):
        StarCamera.open(str(tmp_path))


def test_a_video_file_is_read_through_opencv(tmp_path):
    path = str(tmp_path / "sky.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 15.0, (32, 24))
    for value in (40, 200):
        writer.write(np.dstack([picture(value)] * 3))
    writer.release()
    source = VideoSource(path, timeout_s=1.0)
    values = [int(source.read().image[0, 0]) for _ in range(2)]
    assert np.allclose(values, [40, 200], atol=3)
    with pytest.raises(LinkLost, match="no more pictures"):
        source.read()
    source.close()


def test_a_missing_device_is_not_found():
    with pytest.raises(NotFound, match="video 77"):
        StarCamera.open("77")
