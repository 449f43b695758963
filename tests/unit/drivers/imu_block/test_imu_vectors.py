import json
import re
from pathlib import Path

import pytest

from drivers.imu_block import cobs, protocol
from drivers.imu_block.protocol import (
    Ack,
    CommandParser,
    FrameParser,
    Identify,
    Identity,
    ImuFrame,
    Ping,
    Pong,
    Reset,
    SelfTest,
    SetAveraging,
)

TESTS = Path(__file__).parents[3]
DOCUMENT = TESTS.parent / "docs" / "interfaces" / "imu_block.md"
COMMANDS = {
    "ping": (protocol.encode_ping, Ping),
    "identify": (protocol.encode_identify, Identify),
    "set_averaging": (protocol.encode_set_averaging, SetAveraging),
    "self_test": (protocol.encode_self_test, SelfTest),
    "reset": (protocol.encode_reset, Reset),
}
REPLIES = {"pong": Pong, "ack": Ack, "identity": Identity}


def vectors(name):
    return json.loads((TESTS / "vectors" / name).read_text())


def named(name):
    return [pytest.param(vector, id=vector["name"]) for vector in vectors(name)]


@pytest.mark.parametrize("vector", named("imu_v1.json"))
def test_v1_bytes_are_those_of_the_independent_encoder(vector):
    built = protocol.encode_v1(
        sequence=vector["sequence"],
        gyro_counts=vector["gyro_counts"],
        tilt_difference_counts=tuple(vector["tilt_difference_counts"]),
    )
    assert built.hex(" ") == vector["hex"]


@pytest.mark.parametrize("vector", named("imu_v2.json"))
def test_v2_bytes_are_those_of_the_independent_encoder_and_read_back(vector):
    fields = {key: vector[key] for key in vector if key not in ("name", "hex")}
    assert protocol.encode_v2(**fields).hex(" ") == vector["hex"]
    (frame,) = FrameParser().feed(bytes.fromhex(vector["hex"]))
    assert isinstance(frame, ImuFrame)
    assert (frame.version, frame.tick_ms, frame.sample_count) == (
        2,
        fields["tick_ms"],
        fields["sample_count"],
    )
    assert frame.gyro_counts == fields["gyro_counts"]
    assert list(frame.tilt_counts) == fields["tilt_counts"]
    assert list(frame.housekeeping) == fields["housekeeping"]
    assert frame.attention is fields["attention"]
    assert frame.end_offset == protocol.V2_WIRE_BYTES - 1


@pytest.mark.parametrize("vector", named("imu_packets.json"))
def test_commands_and_replies_are_those_of_the_independent_encoder_and_read_back(vector):
    wire = bytes.fromhex(vector["hex"])
    fields = vector["fields"]
    if vector["from"] == "host":
        encode, kind = COMMANDS[vector["name"]]
        assert encode(**fields) == wire
        assert CommandParser().feed(wire) == [kind(**fields)]
    else:
        reply = REPLIES[vector["name"]](**fields)
        assert protocol.encode_reply(reply) == wire
        assert FrameParser(2).feed(wire) == [reply]


def test_every_byte_sequence_in_the_interface_document_is_a_vector():
    text = DOCUMENT.read_text()
    known = {v["hex"] for name in ("imu_v1.json", "imu_v2.json", "imu_packets.json") for v in vectors(name)}
    shown = set(re.findall(r"`((?:[0-9a-f]{2} ){6,}[0-9a-f]{2})`", text))
    shown |= set(re.findall(r"on the wire +((?:[0-9a-f]{2} ?){21})\n", text))
    assert len(shown) == 15
    assert shown <= known


@pytest.mark.parametrize(
    ("packet", "stuffed"),
    [
        ("", "01"),
        ("00", "01 01"),
        ("00 00", "01 01 01"),
        ("11 22 00 33", "03 11 22 02 33"),
        ("11 22 33 44", "05 11 22 33 44"),
        ("11 00 00 00", "02 11 01 01 01"),
    ],
)
def test_stuffing_agrees_with_the_published_examples(packet, stuffed):
    assert cobs.encode(bytes.fromhex(packet)) == bytes.fromhex(stuffed)
    assert cobs.decode(bytes.fromhex(stuffed)) == bytes.fromhex(packet)
