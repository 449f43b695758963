"""Envelopes travel as attachments: whole or refused."""

import pytest
from groundstation.bus.topics import TOPICS
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus.envelope import Cause, Envelope

U32 = st.integers(0, 2**32 - 1)
envelopes = st.builds(
    Envelope,
    st.sampled_from(TOPICS),
    st.sampled_from(["", "alpha", "bravo_2"]),
    U32,
    st.integers(-(2**63), 2**63 - 1),
    U32,
    U32,
    st.lists(st.builds(Cause, st.integers(0, 255), U32), max_size=9).map(tuple),
)


@settings(derandomize=True)
@given(envelopes)
def test_an_envelope_survives_its_attachment(envelope):
    assert Envelope.unpack(envelope.topic, envelope.vehicle, envelope.pack()) == envelope


@settings(derandomize=True)
@given(envelopes, st.data())
def test_an_attachment_cut_anywhere_is_refused(envelope, data):
    packed = envelope.pack()
    cut = data.draw(st.integers(0, len(packed) - 1))
    with pytest.raises(ValueError, match="cut off"):
        Envelope.unpack(envelope.topic, envelope.vehicle, packed[:cut])


def test_a_call_of_more_than_four_seconds_is_noted_as_the_longest_that_fits():
    slow = Envelope(TOPICS[0], "alpha", 1, 0, wall_ns=10**11, cpu_ns=10**11)
    back = Envelope.unpack(TOPICS[0], "alpha", slow.pack())
    assert back.wall_ns == back.cpu_ns == 2**32 - 1
