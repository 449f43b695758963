import itertools
import re
import tracemalloc

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.star_camera.camera_frame import CameraFrame
from drivers.star_camera.exposure import ExposureDelay
from drivers.star_camera.multipart import PartParser, boundary_of
from drivers.star_camera.picture import decode_picture, to_mono
from drivers.star_camera.refusals import PictureRefused

BOUNDARY = b"--frame"
BODIES = st.binary(max_size=60).filter(lambda body: BOUNDARY not in body)


def part(body, has_length=True, headers=()):
    lines = [b"--frame", b"Content-Type: application/x-mono8", *headers]
    if has_length:
        lines.append(b"Content-Length: %d" % len(body))
    return b"\r\n".join(lines) + b"\r\n\r\n" + body + b"\r\n"


def cut(stream, places):
    edges = sorted({0, len(stream), *(place % (len(stream) + 1) for place in places)})
    return [stream[a:b] for a, b in itertools.pairwise(edges)]


@given(st.lists(st.tuples(BODIES, st.booleans()), max_size=5), st.lists(st.integers(0, 10_000), max_size=12))
def test_parts_survive_any_chunking(bodies, places):
    stream = b"".join(part(body, has_length) for body, has_length in bodies) + b"--frame"
    parser = PartParser(BOUNDARY)
    assert [p.body for chunk in cut(stream, places) for p in parser.feed(chunk)] == [
        body for body, _ in bodies
    ]
    assert parser.bytes_skipped == 0


@given(st.lists(st.binary(max_size=400), max_size=20))
@settings(deadline=None)
def test_garbage_never_raises_and_a_good_part_follows(chunks):
    parser = PartParser(BOUNDARY)
    for chunk in chunks:
        list(parser.feed(chunk))
    if BOUNDARY in b"".join(chunks):
        return
    assert [p.body for p in parser.feed(b"\r\n" + part(b"picture"))] == [b"picture"]


def test_a_part_cut_short_costs_only_itself():
    parser = PartParser(BOUNDARY)
    whole = part(b"x" * 100)
    bodies = [p.body for p in parser.feed(whole[:80] + part(b"good") + part(b"also good"))]
    assert bodies[-2:] == [b"good", b"also good"]


@pytest.mark.parametrize("length", [b"nonsense", b"-5", b"99999999999"])
def test_a_senseless_length_costs_nothing(length):
    parser = PartParser(BOUNDARY)
    bad = b"--frame\r\nContent-Length: " + length + b"\r\n\r\nbody\r\n"
    bodies = [p.body for chunk in (bad, part(b"good"), part(b"next")) for p in parser.feed(chunk)]
    assert bodies == [b"body", b"good", b"next"]


@pytest.mark.parametrize(
    "wrong", [lambda n: n - 1, lambda n: n // 2, lambda n: n + 1, lambda n: 3 * n, lambda n: 31_000_000]
)
@pytest.mark.parametrize("kind", [".jpg", ".png"])
def test_a_wrong_length_costs_no_picture(wrong, kind):
    bodies = [cv2.imencode(kind, np.roll(STARS, shift, 1))[1].tobytes() for shift in range(4)]
    stream = b"".join(
        b"--frame\r\nContent-Length: %d\r\n\r\n%s\r\n" % (wrong(len(body)), body) for body in bodies
    )
    parser = PartParser(BOUNDARY)
    assert [p.body for chunk in cut(stream, range(0, 9000, 100)) for p in parser.feed(chunk)] == bodies


@pytest.mark.parametrize("wrong", [7, 400, 1_000_000])
def test_a_wrong_length_of_what_does_not_mark_its_end_costs_one_part(wrong):
    bad = b"--frame\r\nContent-Length: %d\r\n\r\n" % wrong + b"x" * 100 + b"\r\n"
    parser = PartParser(BOUNDARY)
    bodies = [p.body for chunk in (bad, part(b"good"), part(b"next")) for p in parser.feed(chunk)]
    assert bodies[-2:] == [b"good", b"next"]


@pytest.mark.parametrize("head", [b"", b"Content-Length: 30000000\r\n", b"Content-Type: image/jpeg\r\n"])
def test_a_body_without_end_takes_a_bounded_memory(head):
    parser, chunk = PartParser(BOUNDARY), b"x" * (1 << 20)
    start = b"\xff\xd8\xff\xe0" if b"jpeg" in head else b""
    list(parser.feed(b"--frame\r\n" + head + b"\r\n" + start))
    tracemalloc.start()
    try:
        for _ in range(150):
            list(parser.feed(chunk))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 80e6
    assert [p.body for p in parser.feed(b"\r\n" + part(b"good"))][-1:] == [b"good"]


def test_a_stream_that_ends_gives_its_last_part():
    parser = PartParser(BOUNDARY)
    assert not list(parser.feed(b"--frame\r\n\r\nunmarked"))
    assert [p.body for p in parser.finish()] == [b"unmarked"]
    assert not list(parser.finish())


@given(st.lists(st.integers(0, 63), min_size=1, max_size=4), st.lists(st.integers(0, 30_000), max_size=12))
def test_pictures_end_by_themselves_whatever_the_chunking(shifts, places):
    bodies = [jpeg(np.roll(STARS, shift, 1)) for shift in shifts]
    stream = b"".join(b"--frame\n\n" + body + b"\n" for body in bodies)
    parser = PartParser(None)
    assert [p.body for chunk in cut(stream, places) for p in parser.feed(chunk)] == bodies


def test_the_end_of_a_thumbnail_is_not_that_of_its_picture():
    whole = jpeg(STARS)
    app1 = b"Exif\0\0" + jpeg(STARS[:16, :16])
    body = whole[:2] + b"\xff\xe1" + (len(app1) + 2).to_bytes(2) + app1 + whole[2:]
    assert [p.body for p in PartParser(BOUNDARY).feed(b"--frame\r\n\r\n" + body)] == [body]


def damaged(rng, whole, kind):
    """A JPEG as a bad link leaves it; its beginning, where the tables are, and its end are whole."""
    first, n = whole.index(b"\xff\xda") + 20, len(whole)
    at = int(rng.integers(first, n - 200))
    count = int(rng.integers(2, 150))
    if kind == "lost":
        return whole[:at] + whole[at + count :]
    if kind == "zeros":
        return whole[:at] + bytes(count) + whole[at + count :]
    if kind == "doubled":
        return whole[: at + count] + whole[at:]
    restarts = [m.start() for m in re.finditer(rb"\xff[\xd0-\xd7]", whole)]
    i = int(rng.integers(len(restarts) - 4))
    return whole[: restarts[i]] + whole[restarts[i + int(rng.integers(1, 4))] :]  # whole intervals lost


@pytest.mark.parametrize("kind", ["lost", "zeros", "doubled", "intervals"])
def test_a_jpeg_that_its_decoder_warns_of_is_refused(kind):
    rng = np.random.default_rng(1)
    image = rng.normal(10.0, 2.0, (240, 320)).clip(0, 255).astype(np.uint8)
    restarts = [cv2.IMWRITE_JPEG_RST_INTERVAL, 10] if kind == "intervals" else []
    whole = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 90, *restarts])[1].tobytes()
    assert np.array_equal(
        decode_picture({}, whole), cv2.imdecode(np.frombuffer(whole, np.uint8), cv2.IMREAD_GRAYSCALE)
    )
    refused = 0
    for _ in range(200):
        try:
            decode_picture({}, damaged(rng, whole, kind))
        except PictureRefused as refusal:
            refused += refusal.kind == "a JPEG is damaged"
    assert refused >= 195  # the rest are damages that leave as many blocks as there were


def test_headers_without_end_are_given_up():
    parser = PartParser(BOUNDARY)
    assert not list(parser.feed(BOUNDARY + b"x" * 20_000))
    assert [p.body for p in parser.feed(part(b"good"))] == [b"good"]
    assert parser.bytes_skipped >= 20_000


def test_the_boundary_is_read_from_the_content_type():
    assert boundary_of("multipart/x-mixed-replace; boundary=frame") == b"--frame"
    assert boundary_of('multipart/x-mixed-replace;boundary="--frame"') == b"--frame"
    assert boundary_of("text/html; charset=utf-8") is None
    assert boundary_of("multipart/x-mixed-replace") is None


STARS = np.zeros((48, 64), np.uint8)
STARS[20, 30] = 255
STARS[40, 3] = 128


def jpeg(image):
    return cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 90])[1].tobytes()


def png(image):
    return cv2.imencode(".png", image)[1].tobytes()


def test_raw_and_png_pictures_are_exact():
    raw = {"content-type": "application/x-mono8", "x-width": "64", "x-height": "48"}
    assert np.array_equal(decode_picture(raw, STARS.tobytes()), STARS)
    assert np.array_equal(decode_picture({"content-type": "image/png; q=1"}, png(STARS)), STARS)


def test_a_jpeg_is_grey_and_close():
    image = decode_picture({"content-type": "image/jpeg"}, jpeg(STARS) + b"\0\0")
    assert image.shape == STARS.shape
    assert np.unravel_index(image.argmax(), image.shape) == (20, 30)


@pytest.mark.parametrize("keep", [0, 2, 100, -1])
def test_a_truncated_jpeg_is_refused(keep):
    with pytest.raises(ValueError, match="cut short"):
        decode_picture({"content-type": "image/jpeg"}, jpeg(STARS)[:keep])


def test_a_jpeg_of_nothing_is_refused():
    with pytest.raises(ValueError, match="damaged"):
        decode_picture({"content-type": "image/jpeg"}, b"\xff\xd8" + bytes(50) + b"\xff\xd9")


def test_a_truncated_png_is_refused():
    with pytest.raises(ValueError, match="cut short"):
        decode_picture({"content-type": "image/png"}, png(STARS)[:-20])


@pytest.mark.parametrize(
    ("headers", "size", "complaint"),
    [
        ({"x-width": "64", "x-height": "48"}, 64 * 48 - 1, "bytes"),
        ({"x-width": "64"}, 64 * 48, "X-Height"),
        ({"x-width": "0", "x-height": "48"}, 0, "X-Width"),
        ({"x-width": "-64", "x-height": "-48"}, 64 * 48, "X-Width"),
    ],
)
def test_a_raw_picture_of_another_size_is_refused(headers, size, complaint):
    with pytest.raises(ValueError, match=complaint):
        decode_picture({"content-type": "application/x-mono8", **headers}, bytes(size))


def test_an_unknown_kind_of_picture_is_refused():
    with pytest.raises(ValueError, match="text/html"):
        decode_picture({"content-type": "text/html"}, b"<html>")


def test_a_colour_picture_becomes_grey():
    assert np.array_equal(to_mono(np.dstack([STARS] * 3)), STARS)
    assert to_mono(STARS) is STARS
    for bad in (STARS.astype(np.uint16), np.zeros((0, 4), np.uint8), np.zeros((4, 4, 2), np.uint8)):
        with pytest.raises(ValueError, match="picture of"):
            to_mono(bad)


def test_a_camera_frame_is_grey_or_in_three_colours():
    assert CameraFrame(np.zeros((4, 4, 3), np.uint8), 0, 0).image.shape == (4, 4, 3)
    for bad in (np.zeros((4, 4, 2), np.uint8), np.zeros((4, 4, 3)), np.zeros(4, np.uint8)):
        with pytest.raises(ValueError, match="height, width"):
            CameraFrame(bad, 0, 0)


COLOURED = np.arange(4 * 6 * 3, dtype=np.uint8).reshape(4, 6, 3)


@pytest.mark.parametrize("kind", [".png", "raw"])
def test_a_colour_camera_keeps_its_colours_and_a_grey_one_gets_grey(kind):
    if kind == "raw":
        headers = {"content-type": "application/x-bgr8", "x-width": "6", "x-height": "4"}
        body = COLOURED.tobytes()
    else:
        headers, body = {"content-type": "image/png"}, cv2.imencode(kind, COLOURED)[1].tobytes()
    assert np.array_equal(decode_picture(headers, body, is_colour=True), COLOURED)
    assert decode_picture(headers, body).shape == (4, 6)
    if kind == "raw":
        with pytest.raises(ValueError, match="has 71 bytes"):
            decode_picture(headers, body[:-1], is_colour=True)


def test_a_grey_picture_of_a_colour_camera_is_refused():
    raw = {"content-type": "application/x-mono8", "x-width": "4", "x-height": "4"}
    png = {"content-type": "image/png"}
    for headers, body in ((raw, bytes(16)), (png, cv2.imencode(".png", STARS)[1].tobytes())):
        with pytest.raises(ValueError, match="not one of 8 bits in colour"):
            decode_picture(headers, body, is_colour=True)


def test_the_exposure_lies_its_delay_before_the_arrival():
    delay = ExposureDelay(delay_s=0.0625, delay_sigma_s=0.002)
    assert delay.middle_ns(1_000_000_000) == 937_500_000
    for bad in (-0.1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="delay_sigma_s"):
            ExposureDelay(0.0, bad)
        with pytest.raises(ValueError, match="delay_s"):
            ExposureDelay(bad, 0.0)
