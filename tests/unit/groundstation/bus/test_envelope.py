"""Sequence and stamp travel beside a payload: whole or refused; cost and trigger do not travel there."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.bus.envelope import Cause, Envelope
from groundstation.parts.table import installed_tables

NOUNS = sorted(installed_tables().payloads)
TOPICS = [kind.TOPIC for kind in installed_tables().payloads.values()]
U32 = st.integers(0, 2**32 - 1)
OWNERS = st.sampled_from(["", "alpha", "bravo_2"])
envelopes = st.builds(
    Envelope,
    st.sampled_from(TOPICS),
    OWNERS,
    U32,
    st.integers(-(2**63), 2**63 - 1),
    U32,
    st.none() | st.builds(Cause, st.sampled_from(NOUNS), OWNERS, U32),
)


@settings(derandomize=True)
@given(envelopes)
def test_what_an_envelope_names_survives_its_attachment(envelope):
    back = Envelope.of_attachment(envelope.topic, envelope.owner, envelope.attachment())
    assert back == envelope._replace(wall_ns=0, trigger=None)


@settings(derandomize=True)
@given(envelopes, st.data())
def test_an_attachment_cut_anywhere_is_refused(envelope, data):
    packed = envelope.attachment()
    cut = data.draw(st.integers(0, len(packed) - 1))
    with pytest.raises(ValueError, match=f"{envelope.topic.noun}: an attachment of {cut} bytes, expected 12"):
        Envelope.of_attachment(envelope.topic, envelope.owner, packed[:cut])


@settings(derandomize=True)
@given(envelopes, st.binary(min_size=1, max_size=40))
def test_an_attachment_that_is_too_long_is_refused(envelope, more):
    with pytest.raises(ValueError, match="expected 12"):
        Envelope.of_attachment(envelope.topic, envelope.owner, envelope.attachment() + more)
