"""Contracts over the topic table: every row's payload is ROS 2, byte for byte, and says its units."""

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
from groundstation.bus.topics import TOPICS, topic_named, topic_of
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from groundstation.bus.cdr import CodecError, ros_fields
from groundstation.bus.ros_schema import ENCODING, register, schema_text
from groundstation.declarations.message import Message

rows = pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.noun)

INTEGERS = {
    "uint8": (0, 2**8 - 1),
    "uint16": (0, 2**16 - 1),
    "uint32": (0, 2**32 - 1),
    "uint64": (0, 2**64 - 1),
    "int64": (-(2**63), 2**63 - 1),
}
LATEST_NS = 2**31 * 10**9 - 1  # the seconds of a ROS 2 stamp are an int32

UNIT = re.compile(r"_(s|ms|ns|m|m_s|m_s2|rad|rad_s|rad_s2|kg|n|nm|pa|c|k|px|px2|dn|hz|ratio|counts|std|cov)$")
# what has no unit, or one per element which its docstring names (so do _std and _cov)
WITHOUT_UNIT = {
    "elongation", "covariance", "std", "innovation", "difference", "mean_difference", "nis", "mean_nis",
    "argument",
}  # fmt: skip


@pytest.fixture(scope="module")
def store():
    made = get_typestore(Stores.ROS2_HUMBLE)
    register(made, [topic.payload for topic in TOPICS])
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


@rows
def test_the_codec_writes_the_bytes_that_ros_2_writes(topic, store):
    name = topic.payload.ROS_TYPE

    @settings(max_examples=30, deadline=None, derandomize=True)
    @given(payloads(topic.payload))
    def check(payload):
        expected = store.serialize_cdr(ros_message(store, name, iter(leaves(payload))), name)
        assert topic.codec.encode(payload) == bytes(expected)

    check()


@rows
def test_a_payload_survives_its_codec_bit_for_bit(topic):
    @settings(max_examples=30, deadline=None, derandomize=True)
    @given(payloads(topic.payload))
    def check(payload):
        back = topic.codec.decode(topic.codec.encode(payload))
        for field in fields(payload):
            assert bits(getattr(back, field.name)) == bits(getattr(payload, field.name)), field.name

    check()


@rows
def test_bytes_cut_anywhere_are_refused_as_such(topic):
    @settings(max_examples=15, deadline=None, derandomize=True)
    @given(payloads(topic.payload), st.data())
    def check(payload, data):
        encoded = topic.codec.encode(payload)
        cut = data.draw(st.integers(0, len(encoded) - 1))
        with pytest.raises(CodecError):
            topic.codec.decode(encoded[:cut])
        with pytest.raises(CodecError):
            topic.codec.decode(encoded + b"\0\0\0\0")

    check()


@rows
def test_noise_is_a_message_or_a_codec_error_and_nothing_else(topic):
    @settings(max_examples=30, deadline=None, derandomize=True)
    @given(payloads(topic.payload), st.data())
    def check(payload, data):
        noisy = bytearray(topic.codec.encode(payload))
        for place in data.draw(st.lists(st.integers(0, len(noisy) - 1), min_size=1, max_size=6)):
            noisy[place] = data.draw(st.integers(0, 255))
        with contextlib.suppress(CodecError):
            topic.codec.decode(bytes(noisy))

    check()


@rows
def test_an_independent_decoder_reads_the_topic_out_of_an_mcap_file(topic):
    @settings(max_examples=10, deadline=None, derandomize=True)
    @given(payloads(topic.payload))
    def check(payload):
        file = io.BytesIO()
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema(topic.payload.ROS_TYPE, ENCODING, schema_text(topic.payload).encode())
        channel = writer.register_channel(f"/a/{topic.noun}", "cdr", schema)
        writer.add_message(channel, 1, topic.codec.encode(payload), 1, 1)
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


@rows
def test_every_float_says_its_unit(topic):
    for name, ros_type in ros_fields(topic.payload):
        if ros_type.startswith("float"):
            assert UNIT.search(name) or name in WITHOUT_UNIT, f"{topic.payload.__name__}.{name}"


@rows
def test_a_payload_class_has_one_topic_and_a_noun_has_one_row(topic):
    assert TOPICS[topic.index] is topic
    assert topic_of(topic.payload) is topic
    assert topic_named(topic.noun) is topic
    assert re.fullmatch(r"[a-z][a-z0-9_]*", topic.noun)
    assert topic.index < 256  # the journal and the causes of an envelope pack it into a byte
