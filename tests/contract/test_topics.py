"""Contracts over the topics of all parts: every payload is ROS 2, byte for byte, and says its units."""

import contextlib
import io
import math
import re
import struct
from collections.abc import Iterator
from dataclasses import fields
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from groundstation.bus.cdr import CodecError, codec_of, ros_fields
from groundstation.bus.ros_schema import ENCODING, register, schema_text
from groundstation.declarations.message import Message
from groundstation.declarations.topic import Topic
from groundstation.parts.table import installed_tables

PAYLOADS = installed_tables().payloads
kinds = pytest.mark.parametrize("kind", PAYLOADS.values(), ids=PAYLOADS)

INTEGERS = {
    "uint8": (0, 2**8 - 1),
    "uint16": (0, 2**16 - 1),
    "uint32": (0, 2**32 - 1),
    "uint64": (0, 2**64 - 1),
    "int64": (-(2**63), 2**63 - 1),
}
LATEST_NS = 2**31 * 10**9 - 1  # the seconds of a ROS 2 stamp are an int32

UNIT = re.compile(
    r"_(s|ms|ns|m|m_s|m_s2|rad|rad_s|rad_s2|kg|n|nm|pa|c|k|px|px2|dn|hz|ratio|counts|sigma|covariance)$"
)
# what has no unit, or one per element which its docstring names (so do _sigma and _covariance)
WITHOUT_UNIT = {
    "elongation", "covariance", "sigma", "innovation", "difference", "mean_difference", "nis", "mean_nis",
    "quaternion_xyzw",
}  # fmt: skip


@pytest.fixture(scope="module")
def store():
    made = get_typestore(Stores.ROS2_HUMBLE)
    register(made, PAYLOADS.values())
    return made


def scalars(base: str) -> st.SearchStrategy:
    if base == "bool":
        return st.booleans()
    if base == "string":
        return st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)
    if base in INTEGERS:
        return st.integers(*INTEGERS[base])
    return st.floats(width=int(base.removeprefix("float")))


def values(ros_type: str) -> st.SearchStrategy:
    base, bracket, rest = ros_type.partition("[")
    if not bracket:
        return scalars(base)
    if ros_type == "uint8[]":
        return st.binary(max_size=40)
    length = int(rest[:-1] or 0)
    elements = st.lists(scalars(base), min_size=length, max_size=length or 6)
    if base == "float32":
        return elements.map(lambda x: np.array(x, dtype=np.float32))
    return elements.map(tuple)


def payloads(cls: type[Message]) -> st.SearchStrategy[Message]:
    vehicles = st.text("abcdefgh_é", max_size=9)  # every alignment of what follows the header
    return st.builds(
        cls, st.integers(0, LATEST_NS), vehicles, *(values(ros_type) for _, ros_type in ros_fields(cls))
    )


def leaves(payload: Message) -> list:
    seconds, nanoseconds = divmod(payload.stamp_ns, 10**9)
    own = [getattr(payload, name) for name, _ in ros_fields(type(payload))]
    return [seconds, nanoseconds, payload.vehicle, *own]


def ros_message(store, typename: str, flat: Iterator):
    """A nested rosbags message from the flat leaves of a payload."""
    arguments = []
    for _, (kind, what) in store.fielddefs[typename][1]:
        if kind == Nodetype.NAME:
            arguments.append(ros_message(store, what, flat))
            continue
        value = next(flat)
        if kind != Nodetype.BASE and what[0][1][0] != "string":
            value = np.frombuffer(value, np.uint8) if isinstance(value, bytes) else value
            value = np.array(value, dtype=what[0][1][0])
        elif kind != Nodetype.BASE:
            value = list(value)
        arguments.append(value)
    return store.types[typename](*arguments)


def bits(value: object) -> object:
    """A value whose equality is equality of bits, NaN and minus zero included."""
    if isinstance(value, float):
        return struct.pack("<d", value)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.tobytes()
    if isinstance(value, tuple):
        return tuple(bits(element) for element in value)
    return type(value), value


@kinds
def test_the_codec_writes_the_bytes_that_ros_2_writes(kind, store):
    name = kind.ROS_TYPE

    @settings(max_examples=30, deadline=None, derandomize=True)
    @given(payloads(kind))
    def check(payload):
        expected = store.serialize_cdr(ros_message(store, name, iter(leaves(payload))), name)
        assert codec_of(kind).encode(payload) == bytes(expected)

    check()


@kinds
def test_a_payload_survives_its_codec_bit_for_bit(kind):
    @settings(max_examples=30, deadline=None, derandomize=True)
    @given(payloads(kind))
    def check(payload):
        back = codec_of(kind).decode(codec_of(kind).encode(payload))
        for field in fields(payload):
            assert bits(getattr(back, field.name)) == bits(getattr(payload, field.name)), field.name

    check()


@kinds
def test_bytes_cut_anywhere_are_refused_as_such(kind):
    @settings(max_examples=15, deadline=None, derandomize=True)
    @given(payloads(kind), st.data())
    def check(payload, data):
        encoded = codec_of(kind).encode(payload)
        cut = data.draw(st.integers(0, len(encoded) - 1))
        with pytest.raises(CodecError):
            codec_of(kind).decode(encoded[:cut])
        with pytest.raises(CodecError):
            codec_of(kind).decode(encoded + b"\0\0\0\0")

    check()


@kinds
def test_noise_is_a_message_or_a_codec_error_and_nothing_else(kind):
    @settings(max_examples=30, deadline=None, derandomize=True)
    @given(payloads(kind), st.data())
    def check(payload, data):
        noisy = bytearray(codec_of(kind).encode(payload))
        for place in data.draw(st.lists(st.integers(0, len(noisy) - 1), min_size=1, max_size=6)):
            noisy[place] = data.draw(st.integers(0, 255))
        with contextlib.suppress(CodecError):
            codec_of(kind).decode(bytes(noisy))

    check()


@kinds
def test_an_independent_decoder_reads_the_topic_out_of_an_mcap_file(kind):
    @settings(max_examples=10, deadline=None, derandomize=True)
    @given(payloads(kind))
    def check(payload):
        file = io.BytesIO()
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema(kind.ROS_TYPE, ENCODING, schema_text(kind).encode())
        channel = writer.register_channel(f"/a/{kind.TOPIC.noun}", "cdr", schema)
        writer.add_message(channel, 1, codec_of(kind).encode(payload), 1, 1)
        writer.finish()
        file.seek(0)
        (found,) = make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages()
        read = list(decoded_leaves(found.decoded_message))
        assert len(read) == len(leaves(payload))
        for mine, theirs in zip(leaves(payload), read, strict=True):
            assert same(mine, theirs)

    check()


def decoded_leaves(node: object) -> Iterator:
    if isinstance(node, SimpleNamespace) or hasattr(node, "__slots__"):
        names = node.__slots__ if hasattr(node, "__slots__") else vars(node)
        for name in names:
            yield from decoded_leaves(getattr(node, name))
    else:
        yield node


def same(mine: object, theirs: object) -> bool:
    if isinstance(mine, float):
        return mine == theirs or (math.isnan(mine) and math.isnan(theirs))
    if isinstance(mine, bytes):
        return mine == bytes(theirs)
    if isinstance(mine, tuple | np.ndarray):
        return len(mine) == len(theirs) and all(map(same, map(plain, mine), map(plain, theirs)))
    return mine == theirs


def plain(value: object) -> object:
    return float(value) if isinstance(value, np.floating) else value


@kinds
def test_every_float_says_its_unit(kind):
    for name, ros_type in ros_fields(kind):
        if ros_type.startswith("float"):
            assert UNIT.search(name) or name in WITHOUT_UNIT, f"{kind.__name__}.{name}"


def test_no_name_is_excused_from_units_that_no_message_has():
    named = {name for kind in PAYLOADS.values() for name, _ in ros_fields(kind)}
    assert named >= WITHOUT_UNIT


@kinds
def test_a_payload_class_has_one_topic_and_a_noun_has_one_class(kind):
    topic = kind.TOPIC
    assert isinstance(topic, Topic)
    assert [found for found in PAYLOADS.values() if found.TOPIC.noun == topic.noun] == [kind]
    assert [found for found in PAYLOADS.values() if found.TOPIC is topic] == [kind]
    assert re.fullmatch(r"[a-z][a-z0-9_]*", topic.noun)
