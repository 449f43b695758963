"""What the codec refuses to write, and the layout of one message by hand."""

import struct

import numpy as np
import pytest

from groundstation.bus.cdr import Codec, CodecError, codec_of, ros_fields, stamp_of
from groundstation.declarations.errors import NodeError
from groundstation.parts.stars.messages import StarSpots
from groundstation.parts.valves.messages import CanIn


def test_a_message_laid_out_by_hand():
    # CDR counts alignment from behind the four bytes of the encapsulation header
    expected = b"\x00\x01\x00\x00" + struct.pack("<iI", 3, 7) + struct.pack("<I", 6) + b"alpha\0"
    expected += (
        b"\0\0" + struct.pack("<II", 4, 4) + b"mono"[:3] + b"\0" + struct.pack("<I", 1)
    )  # padded to four
    message = CanIn(3_000_000_007, "alpha", 4, b"mon\0", 1)
    assert Codec(CanIn).encode(message) == expected


def test_an_array_of_another_precision_is_refused():
    # it would replay as other numbers than the node next door was given
    kinds = {"float32[]": np.zeros(2), "string": ""}
    spots = StarSpots(0, "alpha", *(kinds.get(kind, 0) for _, kind in ros_fields(StarSpots)))
    with pytest.raises(NodeError, match=r"StarSpots.*u_px: expected float32, found float64"):
        Codec(StarSpots).encode(spots)


@pytest.mark.parametrize("data", [b"", b"\0", b"\0\0\0\0", b"\0\2\0\0" + bytes(40)])
def test_other_encapsulations_are_refused(data):
    with pytest.raises(CodecError, match="little-endian"):
        Codec(CanIn).decode(data)


def test_more_bytes_than_a_message_are_refused_but_padding_is_not():
    data = Codec(CanIn).encode(CanIn(1, "alpha", 2, b"x", 1))
    assert Codec(CanIn).decode(data + b"\0\0\0").data == b"x"
    with pytest.raises(CodecError, match="4 bytes too many"):
        Codec(CanIn).decode(data + b"\0\0\0\0")


def test_a_time_beyond_ros_is_refused():
    with pytest.raises(NodeError, match=r"CanIn.*does not fit its fields"):
        Codec(CanIn).encode(CanIn(2**31 * 10**9, "alpha", 2, b"", 1))


def test_the_stamp_alone_can_be_read_of_any_message():
    data = codec_of(CanIn).encode(CanIn(12_345_678_901, "", 0x181, b"abc", 1))
    assert stamp_of(data) == 12_345_678_901
    for garbled in (data[:11], b"\x00\x00" + data[2:], b""):
        with pytest.raises(CodecError):
            stamp_of(garbled)
