"""Recordings open unchanged in readers that know nothing of this program: mcap, mcap_ros2, rosbags."""

from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from groundstation.bus.cdr import ros_fields
from groundstation.parts.control.messages import Wrench
from groundstation.parts.table import installed_tables
from groundstation.recording.cut import cut
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.recording.writer import Recorder

SOURCE = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"
PAYLOADS = installed_tables().payloads
SHORT_NS = 2_500_000_000
LATCHED = [kind for kind in PAYLOADS.values() if kind.TOPIC.latched]


def rewritten(folder):
    """The flight as the recorder of today writes it: with schemas and channels repeated in the file."""
    path = folder / "run.mcap"
    with Recording(SOURCE) as source, Recorder(path, source.info) as recorder:
        for message in source.messages(PAYLOADS.values(), stop_ns=source.start_ns + SHORT_NS):
            kind = PAYLOADS[message.envelope.topic.noun]
            recorder.record_encoded(kind, message.envelope, message.data, message.log_ns)
    return path


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """A recording, one that was recovered, one that was cut out."""
    folder = tmp_path_factory.mktemp("files")
    whole = rewritten(folder)
    (folder / "run.mcap.part").write_bytes(whole.read_bytes()[:-3000])
    recover(folder / "run.mcap.part", folder / "recovered.mcap")
    cut(whole, folder / "cut.mcap", (0.5, 2.0), LATCHED, lambda *_: None)
    return {"written": whole, "recovered": folder / "recovered.mcap", "cut": folder / "cut.mcap"}


@pytest.fixture(params=["written", "recovered", "cut"])
def path(request, files):
    return files[request.param]


def ours(path):
    with Recording(path) as recording:
        return list(recording.messages(PAYLOADS.values()))


def test_the_mcap_library_reads_every_message_by_the_index(path):
    with path.open("rb") as file:
        found = [
            (c.topic, m.sequence, m.log_time, m.publish_time, m.data)
            for _, c, m in make_reader(file).iter_messages()
        ]
    want = [
        (f"/{m.envelope.owner}/{m.envelope.topic.noun}".replace("//", "/"), m.envelope.sequence, m.log_ns,
         m.envelope.publish_ns, m.data)
        for m in ours(path)
    ]  # fmt: skip
    assert sorted(found) == sorted(want)
    assert len(found) > 500


def test_mcap_ros2_support_decodes_every_message_to_the_same_values(path):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        found = {
            (c.topic, m.sequence, m.log_time): decoded for _, c, m, decoded in reader.iter_decoded_messages()
        }
    for message in ours(path)[::7]:
        name = f"/{message.envelope.owner}/{message.envelope.topic.noun}".replace("//", "/")
        decoded = found[name, message.envelope.sequence, message.log_ns]
        payload = message.payload
        assert decoded.header.stamp.sec * 10**9 + decoded.header.stamp.nanosec == payload.stamp_ns
        assert decoded.header.frame_id == payload.vehicle
        if isinstance(payload, Wrench):
            assert decoded.wrench.force.x == payload.force_x_n
            continue
        for field, _ in ros_fields(type(payload)):
            check_equal(getattr(decoded, field), getattr(payload, field))


def test_rosbags_decodes_every_message_to_the_same_values(path):
    found = 0
    with AnyReader([path]) as reader:
        for connection, log_ns, raw in reader.messages():
            found += 1
            if found % 7:
                continue
            message = reader.deserialize(raw, connection.msgtype)
            stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            payload = decode(connection.topic, bytes(raw))
            assert stamp_ns == payload.stamp_ns
            assert log_ns > 0
            if not isinstance(payload, Wrench):
                for field, _ in ros_fields(type(payload)):
                    check_equal(getattr(message, field), getattr(payload, field))
    assert found == len(ours(path))


def decode(topic, data):
    from groundstation.bus.cdr import codec_of

    return codec_of(PAYLOADS[topic.rpartition("/")[2]]).decode(data)


def check_equal(theirs, own):
    if isinstance(own, str):
        assert theirs == own
    elif isinstance(own, bytes):
        assert bytes(theirs) == own
    elif isinstance(own, tuple) and own and isinstance(own[0], str):
        assert tuple(theirs) == own
    else:
        np.testing.assert_array_equal(np.asarray(theirs), np.asarray(own))
