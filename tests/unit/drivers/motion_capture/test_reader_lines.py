import math

import pytest

from drivers.motion_capture.reader_lines import Failed, Frame, PoseMaker, Ready, decode, encode

UNTURNED = (0.0, 0.0, 0.0, 1.0)


def body(x=0.0, quaternion=UNTURNED):
    return (x, 2.0, 3.0, *quaternion)


@pytest.mark.parametrize(
    "message",
    [Ready(), Failed('no "such" thing'), Frame(3, {}), Frame(2**62, {"a b": body(), "β": body(0.1)})],
)
def test_a_message_survives_its_line(message):
    line = encode(message)
    assert line.count(b"\n") == 1
    assert decode(line) == message


@pytest.mark.parametrize(
    "line", [b"", b"{", b"[]", b"3", b"{}", b'{"stamp_ns": 1}', b'{"stamp_ns": 1, "bodies": {"a": [1]}}']
)
def test_any_other_line_is_a_value_error(line):
    with pytest.raises(ValueError, match=r"."):
        decode(line)


def test_bodies_of_a_frame_bear_its_number():
    maker = PoseMaker((), is_whole=True)
    first, second = (maker.poses(Frame(stamp, {"a": body(1.0), "b": body()})) for stamp in (5, 6))
    assert [(pose.name, pose.frame, pose.is_tracked) for pose in first] == [("a", 0, True), ("b", 0, True)]
    assert [pose.frame for pose in second] == [1, 1]
    assert first[0].position_m == (1.0, 2.0, 3.0)
    assert first[0].quaternion_xyzw == UNTURNED


def test_a_body_that_is_missing_is_untracked_if_frames_are_whole():
    frames = [Frame(1, {"a": body()}), Frame(2, {})]
    whole, polled, asked = (
        PoseMaker((), is_whole=True),
        PoseMaker((), is_whole=False),
        PoseMaker(("b",), is_whole=True),
    )
    assert [[(p.name, p.is_tracked) for p in whole.poses(frame)] for frame in frames] == [
        [("a", True)],
        [("a", False)],
    ]
    assert [len(polled.poses(frame)) for frame in frames] == [1, 0]
    (missing,) = asked.poses(frames[0])
    assert (missing.name, missing.is_tracked, asked.foreign) == ("b", False, 1)
    assert all(map(math.isnan, (*missing.position_m, *missing.quaternion_xyzw)))


@pytest.mark.parametrize(
    "numbers",
    [
        body(math.nan),
        body(math.inf),
        body(quaternion=(0.0, 0.0, 0.0, 0.0)),
        body(quaternion=(0.0, 0.0, 0.0, 1.2)),
        body(quaternion=(math.nan, 0.0, 0.0, 1.0)),
    ],
)
def test_numbers_that_cannot_be_right_are_set_aside_and_counted(numbers):
    maker = PoseMaker((), is_whole=True)
    poses = maker.poses(Frame(1, {"a": numbers, "b": body()}))
    assert [(pose.name, pose.is_tracked) for pose in poses] == [("b", True), ("a", False)]
    assert maker.garbled == 1


def test_a_quaternion_of_single_precision_is_made_unit():
    (pose,) = PoseMaker((), is_whole=True).poses(Frame(1, {"a": body(quaternion=(0.0, 0.0, 0.6, 0.80001))}))
    assert math.hypot(*pose.quaternion_xyzw) == pytest.approx(1.0, abs=1e-15)
