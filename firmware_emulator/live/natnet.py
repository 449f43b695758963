r"""NatNet 3.1, OptiTrack's protocol, as its server speaks it: poses to datagrams. Pure.

Datagrams over UDP, little endian, each `message u16 | bytes of payload u16 | payload`. A client sends CONNECT
(0) and MODEL_REQUEST (4) to the command port; the server answers SERVER_INFO (1) and MODEL (5), and sends
FRAME (7) to the data port that SERVER_INFO names. Layout after the depacketization samples of the NatNet SDK
(`PacketClient.cpp`, `NatNetClient.py`); sections that a server without markers has to leave empty are zero.
"""

import struct
from collections.abc import Sequence
from enum import IntEnum

from drivers.motion_capture.pose import MotionCapturePose

VERSION = (3, 1, 0, 0)
APPLICATION = b"Motive"
TICKS_PER_S = 1_000_000_000
_HEAD = struct.Struct("<HH")
_SERVER_INFO = struct.Struct("<256s4B4BQH?4B")
_RIGID_BODY = 1
_TRACKED = 0x01
_NO_PARENT = -1


class MessageId(IntEnum):
    """First two bytes of a datagram."""

    CONNECT = 0
    SERVER_INFO = 1
    MODEL_REQUEST = 4
    MODEL = 5
    FRAME = 7


def parse_request(datagram: bytes) -> MessageId | None:
    """What a client wants; None for anything that this server does not answer."""
    if len(datagram) < _HEAD.size:
        return None
    message, _ = _HEAD.unpack_from(datagram)
    return MessageId(message) if message in (MessageId.CONNECT, MessageId.MODEL_REQUEST) else None


def encode_server_info(data_port: int) -> bytes:
    """The answer to CONNECT: versions, clock, and the port that frames go to (unicast)."""
    payload = _SERVER_INFO.pack(APPLICATION, *VERSION, *VERSION, TICKS_PER_S, data_port, False, 0, 0, 0, 0)
    return _message(MessageId.SERVER_INFO, payload)


def encode_model(names: Sequence[str]) -> bytes:
    """The answer to MODEL_REQUEST: one rigid body per name, numbered from 1."""
    payload = bytearray(struct.pack("<i", len(names)))
    for number, name in enumerate(names, start=1):
        payload += struct.pack("<i", _RIGID_BODY) + name.encode() + b"\0"
        payload += struct.pack("<ii3fi", number, _NO_PARENT, 0.0, 0.0, 0.0, 0)  # pivot offset, no markers
    return _message(MessageId.MODEL, bytes(payload))


def encode_frame(
    poses: Sequence[MotionCapturePose], numbers: Sequence[int], exposed_ns: int, sent_ns: int
) -> bytes:
    """A frame of poses.

    Args:
        poses: All bodies of one frame.
        numbers: Of each body, as in the model.
        exposed_ns: Middle of the exposure, the server's clock.
        sent_ns: Now, the same clock.
    """
    payload = bytearray(struct.pack("<3i", poses[0].frame, 0, 0))  # no marker sets, no other markers
    payload += struct.pack("<i", len(poses))
    for number, pose in zip(numbers, poses, strict=True):
        place = (*pose.position_m, *pose.quaternion_xyzw) if pose.is_tracked else (0.0,) * 7
        payload += struct.pack("<i7ffH", number, *place, 0.0, _TRACKED if pose.is_tracked else 0)
    payload += struct.pack("<4i", 0, 0, 0, 0)  # no skeletons, labelled markers, force plates, devices
    payload += struct.pack("<IId3Q", 0, 0, exposed_ns / TICKS_PER_S, exposed_ns, sent_ns, sent_ns)
    payload += struct.pack("<Hi", 0, 0)  # frame flags, end of data
    return _message(MessageId.FRAME, bytes(payload))


def _message(message: MessageId, payload: bytes) -> bytes:
    return _HEAD.pack(message, len(payload)) + payload
