"""Pictures by HTTP: exact, stamped at their end, however they are called; and each way to fail."""

import socket
import threading
import time

import cv2
import numpy as np
import pytest
from unit.drivers.star_camera.picture_server import PATIENCE_S, Script, jpeg_part, picture, raw_part, serve

from drivers.errors import LinkLost, NotFound
from drivers.star_camera.port import StarCamera


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
