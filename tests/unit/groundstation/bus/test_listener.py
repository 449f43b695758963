"""What comes from the bus: messages of ours, each latched value once, and a count of everything else."""

import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.listener import Decoder, Remote
from groundstation.parts.control.messages import Wrench
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.valves.messages import CanIn

PAYLOADS = {kind.TOPIC.noun: kind for kind in (CanIn, CalibrationInUse, Wrench)}
WRENCH = Wrench(7, "alpha", 0.1, -0.2, 0.0, 0.0, 0.0, 0.03)
ARMED = CalibrationInUse(7, "alpha", "imu", "", "")


def remote(payload, owner="alpha", sequence=3, publish_ns=9) -> Remote:
    topic = payload.TOPIC
    key = f"{owner}/{topic.noun}" if owner else topic.noun
    attachment = Envelope(topic, owner, sequence, publish_ns).attachment()
    return Remote(key, codec_of(type(payload)).encode(payload), attachment)


@pytest.fixture
def decoder():
    return Decoder(PAYLOADS)


def fields_of(payload):
    return {name: getattr(payload, name) for name in type(payload).__dataclass_fields__}


@pytest.mark.parametrize(("payload", "owner"), [(WRENCH, "alpha"), (CanIn(5, "", 0x181, b"abc", 1), "")])
def test_a_message_of_ours_comes_with_its_envelope(decoder, payload, owner):
    delivered = decoder.decode(remote(payload, owner))
    assert isinstance(delivered, Delivered)
    assert delivered.envelope == Envelope(payload.TOPIC, owner, 3, 9)
    assert fields_of(delivered.payload) == fields_of(payload)
    assert decoder.undecodable == 0


def test_the_envelope_can_be_had_without_the_payload(decoder):
    assert decoder.envelope(remote(WRENCH)._replace(payload=b"")) == Envelope(Wrench.TOPIC, "alpha", 3, 9)


@pytest.mark.parametrize(
    "strange",
    [
        remote(WRENCH)._replace(key="alpha/heartbeat"),
        remote(WRENCH)._replace(key=""),
        remote(WRENCH)._replace(attachment=b""),
        remote(WRENCH)._replace(attachment=bytes(13)),
        remote(WRENCH)._replace(payload=remote(WRENCH).payload[:-1]),
        remote(WRENCH)._replace(payload=b""),
    ],
    ids=["unknown noun", "no key", "no attachment", "long attachment", "cut payload", "no payload"],
)
def test_what_is_none_of_ours_is_counted_and_passed_over(decoder, strange):
    assert decoder.decode(strange) is None
    assert decoder.undecodable == 1
    assert decoder.decode(remote(WRENCH)) is not None
    assert decoder.undecodable == 1


def test_a_latched_value_that_is_repeated_comes_once(decoder):
    assert decoder.decode(remote(ARMED)) is not None
    assert decoder.decode(remote(ARMED)) is None
    assert decoder.undecodable == 0


def test_a_latched_value_of_another_vehicle_or_with_another_number_is_news(decoder):
    assert decoder.decode(remote(ARMED)) is not None
    assert decoder.decode(remote(ARMED, owner="bravo")) is not None
    assert decoder.decode(remote(ARMED, sequence=4)) is not None
    assert decoder.decode(remote(ARMED, sequence=3, publish_ns=11)) is not None  # its process started again


def test_a_message_that_is_not_latched_is_handed_over_each_time(decoder):
    assert decoder.decode(remote(WRENCH)) is not None
    assert decoder.decode(remote(WRENCH)) is not None
