import socket
import threading
import time
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.errors import LinkLost, NotFound
from drivers.star_camera.device_stamp import SenderClock
from drivers.star_camera.port import StarCamera
from drivers.star_camera.refusals import Refusals
from drivers.star_camera.source import FolderSource, Picture, VideoSource

PATIENCE_S = 20.0  # only a failing test waits so long


def picture(value):
    return np.full((24, 32), value, np.uint8)


def raw_part(image, number, *headers):
    head = (
        "--frame\r\nContent-Type: application/x-mono8\r\n"
        f"X-Width: {image.shape[1]}\r\nX-Height: {image.shape[0]}\r\nX-Sequence: {number}\r\n"
        + "".join(f"{header}\r\n" for header in headers)
        + f"Content-Length: {image.size}\r\n\r\n"
    )
    return head.encode() + image.tobytes() + b"\r\n"


def jpeg_part(body):
    return b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(body) + body + b"\r\n"


class Script:
    """What the server sends, in order; an Event in it makes the server wait."""

    def __init__(self, *steps, content_type="multipart/x-mixed-replace; boundary=frame", status=200):
        self.steps, self.content_type, self.status = steps, content_type, status
        self.over = threading.Event()


@contextmanager
def serve(script):
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(script.status)
            self.send_header("Content-Type", script.content_type)
            self.end_headers()
            for step in script.steps:
                if isinstance(step, threading.Event):
                    step.wait(PATIENCE_S)
                else:
                    self.wfile.write(step)
            self.close_connection = True

        def log_message(self, *args):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = False
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/alpha.raw"
    finally:
        script.over.set()
        for step in script.steps:
            if isinstance(step, threading.Event):
                step.set()
        server.shutdown()
        server.server_close()
        thread.join()


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


def test_raw_pictures_over_http_are_exact_and_keep_the_senders_count():
    on, done = threading.Event(), threading.Event()
    script = Script(raw_part(picture(7), 41), on, raw_part(picture(8), 44), done)
    with serve(script) as url, StarCamera.open(url) as camera:
        first = camera.read()
        on.set()
        second = camera.read()
    assert np.array_equal(first.image, picture(7))
    assert (first.sequence, second.sequence, second.image[0, 0]) == (41, 44, 8)


def test_jpeg_over_http_works_and_a_truncated_one_is_counted():
    stars = picture(0)
    stars[10, 12] = 255
    whole = cv2.imencode(".jpg", stars)[1].tobytes()
    done = threading.Event()
    script = Script(jpeg_part(whole[: len(whole) // 2]), jpeg_part(whole), done)
    with serve(script) as url, StarCamera.open(url) as camera:
        frame = camera.read()
        assert np.unravel_index(frame.image.argmax(), frame.image.shape) == (10, 12)
        assert camera.counters.garbled == 1


def numbered(value, number="", stamp=""):
    """A raw part with the headers that are not empty."""
    headers = [f"X-Sequence: {number}"] * bool(number) + [f"X-Timestamp: {stamp}"] * bool(stamp)
    head = "\r\n".join(
        ["--frame", "Content-Type: application/x-mono8", "X-Width: 32", "X-Height: 24", *headers]
    )
    return head.encode() + b"\r\n\r\n" + picture(value).tobytes() + b"\r\n"


@pytest.mark.parametrize(
    ("same", "reason"),
    [
        ({"number": "41"}, "X-Sequence"),
        ({"number": "41", "stamp": "5183.204517"}, "X-Sequence"),
        ({"stamp": "5183.204517"}, "X-Timestamp"),
        ({"stamp": "1764374400.125"}, "X-Timestamp"),
    ],
)
def test_a_picture_with_the_number_or_stamp_of_the_last_one_is_that_one_and_the_camera_frozen(same, reason):
    first, again, done = threading.Event(), threading.Event(), threading.Event()
    script = Script(numbered(7, **same), first, numbered(8, **same), numbered(9, **same), again, done)
    with serve(script) as url, StarCamera.open(url, silence_s=0.3) as camera:
        assert camera.read(PATIENCE_S).image[0, 0] == 7
        first.set()
        again.set()
        with pytest.raises(LinkLost, match=f"2 x frozen: its {reason} repeats"):
            camera.read(PATIENCE_S)
        assert camera.counters.received == 1


@pytest.mark.parametrize("stamps", [("5183", "5183"), ("", ""), ("5183.1", "5183.2")])
def test_a_number_that_goes_on_is_another_picture(stamps):
    on, done = threading.Event(), threading.Event()
    script = Script(numbered(7, "41", stamps[0]), on, numbered(8, "42", stamps[1]), done)
    with serve(script) as url, StarCamera.open(url) as camera:
        assert camera.read(PATIENCE_S).sequence == 41
        on.set()
        assert camera.read(PATIENCE_S).sequence == 42
        done.set()


@pytest.mark.parametrize("clock_s", [time.monotonic, time.time])
@pytest.mark.parametrize("age_s", [3.0, 25.0])
def test_a_picture_that_was_old_on_arrival_stays_old(clock_s, age_s):
    done = threading.Event()
    part = numbered(7, "1", f"{clock_s() - age_s:.6f}")
    with serve(Script(part, done)) as url, StarCamera.open(url) as camera:
        frame = camera.read(PATIENCE_S)
        assert frame.stamp_arrival_ns - frame.stamp_ns >= (age_s - 0.01) * 1e9
        done.set()


def stars_jpeg(value):
    stars = picture(0)
    stars[10, 12] = value
    return cv2.imencode(".jpg", stars)[1].tobytes()


@pytest.mark.parametrize("kind", ["jpeg", "png", "raw"])
def test_without_a_length_each_picture_is_given_when_it_has_come_and_the_last_too(kind):
    head = b"--frame\r\n"
    bodies = [stars_jpeg(200), stars_jpeg(100)]
    if kind == "png":
        bodies = [cv2.imencode(".png", picture(value))[1].tobytes() for value in (200, 100)]
    if kind == "raw":
        head += b"Content-Type: application/x-mono8\r\nX-Width: 32\r\nX-Height: 24\r\n"
        bodies = [picture(value).tobytes() for value in (200, 100)]
    on, done = threading.Event(), threading.Event()
    script = Script(head + b"\r\n" + bodies[0], on, b"\r\n" + head + b"\r\n" + bodies[1], done)
    with serve(script) as url, StarCamera.open(url) as camera:  # nothing follows: only their own ends tell
        assert camera.read(PATIENCE_S).image.max() > 150
        on.set()
        assert 60 < camera.read(PATIENCE_S).image.max() < 150
        done.set()


@pytest.mark.parametrize(
    "answer_type",
    [
        "multipart/x-mixed-replace; boundary=frame",
        "multipart/x-mixed-replace;boundary=--frame",
        'multipart/x-mixed-replace; boundary="frame"',
        "multipart/x-mixed-replace ; boundary = frame",
        "Multipart/X-Mixed-Replace; charset=utf-8; Boundary=frame",
        "multipart/x-mixed-replace",
        "application/octet-stream",
        "",
    ],
)
@pytest.mark.parametrize("line_end", [b"\r\n", b"\n"])
@pytest.mark.parametrize(
    "part_type", ["image/jpeg", "image/jpg", "image/pjpeg", "application/octet-stream", "IMAGE/JPEG; q=1", ""]
)
def test_a_stream_is_taken_by_its_first_bytes_however_it_is_called(answer_type, line_end, part_type):
    lines = (
        [b"--frame"]
        + [b"Content-Type: " + part_type.encode()] * bool(part_type)
        + [b"", stars_jpeg(200), b""]
    )
    done = threading.Event()
    with (
        serve(Script(line_end.join(lines), done, content_type=answer_type)) as url,
        StarCamera.open(url) as camera,
    ):
        image = camera.read(PATIENCE_S).image
        assert np.unravel_index(image.argmax(), image.shape) == (10, 12)
        done.set()


def test_what_is_no_picture_is_counted_with_its_type():
    part = b"--frame\r\nContent-Type: text/plain\r\nContent-Length: 5\r\n\r\nhello\r\n"
    done = threading.Event()
    with serve(Script(part * 3, done)) as url, StarCamera.open(url, silence_s=0.2) as camera:
        with pytest.raises(LinkLost, match=r"3 x neither JPEG, PNG nor raw \(content type 'text/plain'\)"):
            camera.read(PATIENCE_S)
        done.set()


@pytest.mark.parametrize("head", [b"HTTP/1.0 200 OK\r\nContent-Type: ", b"HTTP/1.0 "])
def test_an_answer_that_trickles_is_not_waited_for(head):
    """One byte at a time never lets a socket time out; the answer as a whole must."""
    over = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def trickle():
            link, _ = server.accept()
            with link:
                for byte in head + b"x" * 100_000:
                    if over.wait(0.005):
                        return
                    link.send(bytes([byte]))

        thread = threading.Thread(target=trickle)
        thread.start()
        try:
            with pytest.raises(NotFound, match="does not answer: timed out"):
                StarCamera.open(f"http://127.0.0.1:{server.getsockname()[1]}/", silence_s=0.2)
        finally:
            over.set()
            thread.join()


def test_garbage_between_pictures_is_survived():
    done = threading.Event()
    noise = np.random.default_rng(3).integers(0, 256, 5000, np.uint8).tobytes()
    with serve(Script(noise, raw_part(picture(9), 0), done)) as url, StarCamera.open(url) as camera:
        assert camera.read().image[0, 0] == 9


def test_a_server_that_falls_silent_is_a_lost_link():
    done = threading.Event()
    with serve(Script(raw_part(picture(1), 0), done)) as url, StarCamera.open(url, silence_s=0.2) as camera:
        camera.read()
        with pytest.raises(LinkLost, match=url):
            camera.read()


def test_a_server_that_sends_only_garbage_is_a_lost_link():
    done = threading.Event()
    with (
        serve(Script(b"no picture at all" * 1000, done)) as url,
        StarCamera.open(url, silence_s=0.2) as camera,
        pytest.raises(LinkLost, match=url),
    ):
        camera.read()


def test_a_server_that_ends_is_a_lost_link():
    with serve(Script(raw_part(picture(1), 0))) as url, StarCamera.open(url) as camera:
        camera._thread.join()
        camera.read()
        with pytest.raises(LinkLost, match="ended its stream"):
            camera.read()


def test_a_dead_server_is_not_found():
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        with pytest.raises(NotFound, match="does not answer"):
            StarCamera.open(f"http://127.0.0.1:{nobody.getsockname()[1]}/")


def test_a_server_that_accepts_and_says_nothing_is_not_found():
    with socket.create_server(("127.0.0.1", 0)) as mute, pytest.raises(NotFound, match="does not answer"):
        StarCamera.open(f"http://127.0.0.1:{mute.getsockname()[1]}/", silence_s=0.1)


@pytest.mark.parametrize(
    "script", [Script(content_type="text/html"), Script(status=404)], ids=["html", "404"]
)
def test_a_server_without_a_picture_stream_is_not_found(script):
    with serve(script) as url, pytest.raises(NotFound, match="no picture stream"):
        StarCamera.open(url)


def test_an_impossible_url_is_not_found():
    with pytest.raises(NotFound, match="does not answer"):
        StarCamera.open("http://127.0.0.1:99999/")


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
