"""The record stream: what was put in comes out; anything else is no batch and says so."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.bus.envelope import Cause, Envelope
from groundstation.bus.record_stream import BatchError, Recorded, RecordWriter, read_batch
from groundstation.declarations.topic import Topic

U32 = st.integers(0, 2**32 - 1)
NOUNS = st.sampled_from(["imu", "state", "wrench", "alpha"])  # a noun may be spelt like an owner
OWNERS = st.sampled_from(["", "alpha", "bravo", "flight_of_\u00e9"])
envelopes = st.builds(
    Envelope,
    NOUNS.map(Topic),
    OWNERS,
    U32,
    st.integers(-(2**63), 2**63 - 1),
    st.integers(0, 2**40),
    st.none() | st.builds(Cause, NOUNS, OWNERS, U32),
)
messages = st.lists(st.tuples(envelopes, st.binary(max_size=40)), max_size=8)
LONGEST_NS = 2**32 - 1


def batch_of(sent) -> bytes:
    writer = RecordWriter()
    for envelope, data in sent:
        writer.add(envelope, data)
    return writer.take()


def as_recorded(envelope: Envelope, data: bytes) -> Recorded:
    topic, owner, sequence, publish_ns, wall_ns, trigger = envelope
    return Recorded(topic.noun, owner, sequence, publish_ns, min(wall_ns, LONGEST_NS), trigger, data)


@given(st.lists(messages, max_size=3))
def test_batches_give_back_what_was_put_in_with_costs_and_triggers(batches):
    writer = RecordWriter()
    for sent in batches:
        for envelope, data in sent:
            writer.add(envelope, data)
        assert len(writer) == len(sent)
        assert writer.size == sum(len(data) for _, data in sent)
        packed = writer.take()
        assert (len(writer), writer.size) == (0, 0)
        assert list(read_batch(packed)) == [as_recorded(*each) for each in sent]


@given(messages, st.sets(NOUNS))
def test_of_some_topics_the_messages_are_those_of_all_without_the_others(sent, nouns):
    wanted = [as_recorded(*each) for each in sent if each[0].topic.noun in nouns]
    assert list(read_batch(batch_of(sent), nouns)) == wanted


@given(messages, st.data())
def test_a_batch_cut_anywhere_is_refused_before_anything_of_it_is_taken(sent, data):
    packed = batch_of(sent)
    cut = data.draw(st.integers(0, len(packed) - 1))
    with pytest.raises(BatchError):
        read_batch(packed[:cut])


@given(messages, st.binary(min_size=1, max_size=30))
def test_a_batch_that_goes_on_is_refused(sent, more):
    with pytest.raises(BatchError):
        read_batch(batch_of(sent) + more)


@given(messages, st.data())
def test_a_flipped_bit_of_the_head_is_refused(sent, data):
    packed = bytearray(batch_of(sent))
    bit = data.draw(st.integers(0, 12 * 8 - 1))
    packed[bit // 8] ^= 1 << bit % 8
    with pytest.raises(BatchError):
        list(read_batch(bytes(packed)))


@given(messages, st.data())
def test_noise_is_a_batch_or_a_batch_error_and_nothing_else(sent, data):
    packed = bytearray(batch_of(sent))
    for place in data.draw(st.lists(st.integers(0, len(packed) - 1), min_size=1, max_size=6)):
        packed[place] = data.draw(st.integers(0, 255))
    try:
        found = list(read_batch(bytes(packed)))
    except BatchError:
        return
    assert sum(len(message.data) for message in found) <= len(packed)


@given(st.binary(max_size=80))
def test_bytes_of_others_are_no_batch(data):
    with pytest.raises(BatchError):
        list(read_batch(data))


def test_entries_without_names_are_refused():
    # 12 bytes of head: no names, one entry; then an entry that points at name 0
    packed = bytearray(batch_of([]))
    packed[8:12] = (1).to_bytes(4, "little")
    with pytest.raises(BatchError):
        list(read_batch(bytes(packed) + bytes(32)))
