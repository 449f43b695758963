"""What is recorded comes back, in order and bit for bit; equal runs give equal files."""

import itertools
import tempfile
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.record_stream import RecordWriter, read_batch
from groundstation.bus.ros_schema import ENCODING, schema_text
from groundstation.parts.control.messages import Wrench
from groundstation.parts.operation.messages import CalibrationInUse
from groundstation.parts.table import installed_tables
from groundstation.recording.channel_names import channel_name, parse_channel
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder

PAYLOADS = installed_tables().payloads
KINDS = PAYLOADS.values()
EVERYTHING = RecordingInfo(images=ImagePolicy.LOSSLESS)


def record(path, flight, info=EVERYTHING):
    with Recorder(path, info) as recorder:
        for delivered in flight:
            recorder.record(delivered, delivered.envelope.publish_ns)
    return path


def encoded(flight):
    return [(d.envelope, codec_of(type(d.payload)).encode(d.payload)) for d in flight]


def test_what_was_recorded_comes_back_in_order_and_bit_for_bit(tmp_path, flight):
    with Recording(record(tmp_path / "a.mcap", flight)) as recording:
        found = list(recording.messages(KINDS))
    assert [(r.envelope, r.data) for r in found] == encoded(flight)
    assert [r.log_ns for r in found] == [d.envelope.publish_ns for d in flight]


def test_payloads_come_back_decoded(tmp_path, flight):
    with Recording(record(tmp_path / "a.mcap", flight)) as recording:
        found = list(recording.delivered(KINDS))
    assert encoded(found) == encoded(flight)


def test_bytes_from_the_bus_and_payloads_make_the_same_file(tmp_path, flight):
    first = record(tmp_path / "a.mcap", flight)
    with Recorder(tmp_path / "b.mcap", RecordingInfo(images=ImagePolicy.LOSSLESS)) as recorder:
        for envelope, data in encoded(flight):
            recorder.record_encoded(PAYLOADS[envelope.topic.noun], envelope, data, envelope.publish_ns)
    assert first.read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_two_equal_runs_give_equal_bytes(tmp_path, flight):
    info = RecordingInfo("[table]\n", "rigs/two.toml", ImagePolicy.SPOTS, {"b": "2", "a": "1"}, 7, "x 1")
    assert (
        record(tmp_path / "a.mcap", flight, info).read_bytes()
        == record(tmp_path / "b.mcap", flight, info).read_bytes()
    )


def test_topics_and_owners_can_be_chosen(tmp_path, flight):
    with Recording(record(tmp_path / "a.mcap", flight)) as recording:
        found = list(recording.messages([Wrench], ["bravo"]))
        assert [(r.envelope, r.data) for r in found] == [
            item for item in encoded(flight) if item[0].topic is Wrench.TOPIC and item[0].owner == "bravo"
        ]
        assert list(recording.messages([], None)) == []


def test_a_stretch_of_time_can_be_chosen(tmp_path, flight):
    with Recording(record(tmp_path / "a.mcap", flight)) as recording:
        found = [r.log_ns for r in recording.messages(KINDS, start_ns=300_000_000, stop_ns=700_000_000)]
    assert found == [
        d.envelope.publish_ns for d in flight if 300_000_000 <= d.envelope.publish_ns < 700_000_000
    ]


def test_messages_logged_late_come_in_the_order_of_their_log_times(tmp_path, flight):
    # the recorder of a live rig gets a message of another process after newer ones of its own
    with Recorder(tmp_path / "a.mcap", RecordingInfo(images=ImagePolicy.LOSSLESS)) as recorder:
        for place, delivered in enumerate(flight):
            late_ns = 400_000_000 if place % 5 == 0 else 0
            recorder.record(delivered, delivered.envelope.publish_ns + late_ns)
    with Recording(tmp_path / "a.mcap") as recording:
        found = [r.log_ns for r in recording.messages(KINDS)]
    assert len(found) == len(flight)
    assert found == sorted(found)


def test_the_rig_decides_what_is_kept_of_the_cameras(tmp_path, flight):
    kept = {}
    for policy in ImagePolicy:
        path = record(tmp_path / f"{policy}.mcap", flight, RecordingInfo(images=policy))
        with Recording(path) as recording:
            kept[policy] = {channel.noun for channel in recording.channels}
            assert recording.info.images is policy
    assert {"star_image", "star_spots"} <= kept[ImagePolicy.LOSSLESS]
    assert kept[ImagePolicy.LOSSLESS] - kept[ImagePolicy.SPOTS] == {"star_image"}
    assert kept[ImagePolicy.SPOTS] - kept[ImagePolicy.OFF] == {"star_spots"}


def test_provenance_comes_back(tmp_path):
    info = RecordingInfo(
        "name = 'x'\n", "/lab/x.toml", ImagePolicy.OFF, {"alpha_imu": "ab" * 32}, 42, "groundstation 9", 17
    )
    with Recording(record(tmp_path / "a.mcap", [], info)) as recording:
        assert recording.info == info
        assert list(recording.messages(KINDS)) == []


def test_a_recording_in_virtual_time_names_no_date():
    reported = RecordingInfo(seed=3).to_metadata()
    assert reported["clock"] == "virtual"
    assert "utc_offset_ns" not in reported


def test_an_open_recording_is_a_part_and_loses_at_most_a_quarter_of_a_second(tmp_path, flight):
    path = tmp_path / "run.mcap"
    recorder = Recorder(path, RecordingInfo(images=ImagePolicy.LOSSLESS))
    sizes = [recorder.part_path.stat().st_size]
    for delivered in flight:
        recorder.record(delivered, delivered.envelope.publish_ns)
        sizes.append(recorder.part_path.stat().st_size)
    grown = [d.envelope.publish_ns for d, a, b in zip(flight, sizes, sizes[1:], strict=False) if b > a]
    assert sizes[0] > 0  # the provenance is on the disk at once
    assert max(b - a for a, b in itertools.pairwise(grown)) <= 260_000_000
    assert not path.exists()
    recorder.finish()
    assert recorder.finish() == path
    assert path.exists()
    assert not recorder.part_path.exists()


def test_silence_closes_the_chunk_too(tmp_path, flight):
    recorder = Recorder(tmp_path / "run.mcap", RecordingInfo(), durable=True)
    recorder.record(flight[0], 1_000)
    before = recorder.part_path.stat().st_size
    recorder.tick(200_000_000)
    assert recorder.part_path.stat().st_size == before
    recorder.tick(300_000_000)
    assert recorder.part_path.stat().st_size > before
    recorder.finish()


def test_an_exception_in_the_run_still_finishes_the_recording(tmp_path, flight):
    def run():
        with Recorder(tmp_path / "a.mcap", RecordingInfo()) as recorder:
            recorder.record(flight[0], 1)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run()
    with Recording(tmp_path / "a.mcap") as recording:
        assert len(list(recording.messages(KINDS))) == 1


def test_nothing_already_recorded_is_overwritten(tmp_path, flight):
    path = record(tmp_path / "a.mcap", flight)
    with pytest.raises(RecordingError, match="already there"):
        Recorder(path, RecordingInfo())
    left = tmp_path / "b.mcap.part"
    left.write_bytes(b"what a killed recorder left")
    with pytest.raises(RecordingError, match="not finished"):
        Recorder(tmp_path / "b.mcap", RecordingInfo())
    assert left.read_bytes() == b"what a killed recorder left"


def test_a_folder_that_cannot_be_made_is_one_sentence(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match="cannot be written"):
        Recorder(tmp_path / "file" / "a.mcap", RecordingInfo())


@pytest.mark.parametrize(
    ("content", "sentence"),
    [(b"", "no MCAP"), (b"PK\3\4 something else entirely", "no MCAP"), (b"\x89MCAP0\r\n", "not finished")],
)
def test_a_file_that_is_no_recording_is_refused_in_one_sentence(tmp_path, content, sentence):
    path = tmp_path / "x.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=sentence):
        Recording(path)


def test_a_file_that_is_not_there_is_refused_in_one_sentence(tmp_path):
    with pytest.raises(RecordingError, match="No such file"):
        Recording(tmp_path / "nothing.mcap")


def test_a_damaged_chunk_is_named_and_not_passed_over(tmp_path, flight):
    path = record(tmp_path / "a.mcap", flight)
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 0x40
    path.write_bytes(data)
    with Recording(path) as recording, pytest.raises(RecordingError, match="recover"):
        list(recording.messages(KINDS))


def test_a_viewer_reads_the_file(tmp_path, flight):
    path = record(tmp_path / "a.mcap", flight)
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        found = list(reader.iter_decoded_messages(topics=["/alpha/wrench"]))
    wanted = [d.payload for d in flight if isinstance(d.payload, Wrench) and d.payload.vehicle == "alpha"]
    assert [f.decoded_message.wrench.force.x for f in found] == [w.force_x_n for w in wanted]
    assert {f.schema.name for f in found} == {"geometry_msgs/msg/WrenchStamped"}


@pytest.mark.parametrize("noun", PAYLOADS)
def test_channel_names_are_read_back(noun):
    owner = "" if PAYLOADS[noun].TOPIC.scope.name == "RIG" else "alpha"
    assert parse_channel(channel_name(noun, owner)) == (noun, owner)


def test_channels_of_others_are_left_alone(tmp_path, flight):
    """Another recorder's channels are listed with what they hold, and nothing of them is read as ours."""
    path = tmp_path / "mixed.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        tf = writer.register_schema(
            "tf2_msgs/msg/TFMessage", "ros2msg", b"geometry_msgs/TransformStamped[] t\n"
        )
        wrench = writer.register_schema(Wrench.ROS_TYPE, ENCODING, schema_text(Wrench).encode())
        ours = next(d.payload for d in flight if isinstance(d.payload, Wrench))
        writer.add_message(writer.register_channel("/tf", "cdr", tf), 1, bytes(20), 1, 1)
        writer.add_message(writer.register_channel("/notes", "json", 0), 2, b"{}", 2, 1)
        channel = writer.register_channel("/alpha/wrench", "cdr", wrench)
        writer.add_message(channel, 3, codec_of(Wrench).encode(ours), 3, 1)
        writer.add_metadata("groundstation", RecordingInfo().to_metadata())
        writer.finish()
    with Recording(path) as recording:
        assert [(c.noun, c.owner, c.count) for c in recording.channels] == [
            ("tf", "", 1),
            ("wrench", "alpha", 1),
        ]
        assert [message.envelope.topic.noun for message in recording.messages(KINDS)] == ["wrench"]


def test_channels_are_sorted_by_noun_and_owner_and_say_what_they_hold(tmp_path, flight):
    with Recording(record(tmp_path / "a.mcap", flight)) as recording:
        names = [(channel.noun, channel.owner) for channel in recording.channels]
        assert names == sorted(names)
        published = Counter((d.envelope.topic.noun, d.envelope.owner) for d in flight)
        assert {
            name: channel.count for name, channel in zip(names, recording.channels, strict=True)
        } == published
        assert recording.has(Wrench, "bravo")
        assert not recording.has(Wrench, "charlie")


def test_the_record_stream_and_payloads_make_the_same_file(tmp_path, flight):
    first = record(tmp_path / "a.mcap", flight)
    with Recorder(tmp_path / "b.mcap", EVERYTHING) as recorder:
        for start in range(0, len(flight), 20):
            assert recorder.record_batch(batch_of(flight[start : start + 20]), PAYLOADS) == 0
    assert first.read_bytes() == (tmp_path / "b.mcap").read_bytes()


def batch_of(messages):
    writer = RecordWriter()
    for envelope, data in encoded(messages):
        writer.add(envelope, data)
    return read_batch(writer.take())


def test_a_latched_message_that_a_batch_repeats_is_written_once(tmp_path):
    phase = CalibrationInUse(5, "alpha", "imu", "", "")
    published = [Delivered(Envelope(CalibrationInUse.TOPIC, "alpha", number, 5), phase) for number in (1, 2)]
    with Recorder(tmp_path / "a.mcap", EVERYTHING) as recorder:
        for message in (published[0], published[0], published[1], published[1]):
            assert recorder.record_batch(batch_of([message]), PAYLOADS) == 0
    with Recording(tmp_path / "a.mcap") as recording:
        assert [found.envelope.sequence for found in recording.messages([CalibrationInUse])] == [1, 2]


def test_what_a_witness_records_again_is_written_once_and_what_only_it_has_is_kept(tmp_path):
    demand = Wrench(5, "alpha", *[0.0] * 6)
    sent = [Delivered(Envelope(Wrench.TOPIC, "alpha", number, 5 * number), demand) for number in range(1, 6)]
    reborn = Delivered(Envelope(Wrench.TOPIC, "alpha", 1, 40), demand)
    with Recorder(tmp_path / "a.mcap", EVERYTHING) as recorder:
        for batch in (sent[:3], sent[1:], [reborn], sent[2:]):
            assert recorder.record_batch(batch_of(batch), PAYLOADS) == 0
    with Recording(tmp_path / "a.mcap") as recording:
        found = [message.envelope.publish_ns for message in recording.messages([Wrench])]
    assert found == [5, 10, 15, 20, 25, 40]


@given(
    st.lists(st.sets(st.integers(1, 40), min_size=1).map(sorted), max_size=6),
    st.integers(1, 40),
    st.randoms(),
)
def test_in_whatever_order_witnesses_come_each_message_is_written_once(testimonies, length, order):
    demand = Wrench(5, "alpha", *[0.0] * 6)
    sent = [Delivered(Envelope(Wrench.TOPIC, "alpha", number, 5 * number), demand) for number in range(1, 41)]
    batches = [sent[begin : begin + length] for begin in range(0, 40, length)]
    for numbers in testimonies:  # a witness that takes a topic paced has not seen every message
        batches.insert(order.randint(0, len(batches)), [sent[number - 1] for number in numbers])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        with Recorder(path, EVERYTHING) as recorder:
            for batch in batches:
                assert recorder.record_batch(batch_of(batch), PAYLOADS) == 0
        with Recording(path) as recording:
            found = [message.envelope.sequence for message in recording.messages([Wrench])]
    assert found == list(range(1, 41))


def test_an_older_latched_message_that_comes_later_is_not_the_newest(tmp_path):
    first, second = (
        Delivered(
            Envelope(CalibrationInUse.TOPIC, "alpha", number, 5 * number),
            CalibrationInUse(5 * number, "alpha", "imu", "", ""),
        )
        for number in (1, 2)
    )
    with Recorder(tmp_path / "a.mcap", EVERYTHING) as recorder:
        for message in (second, first):
            recorder.record_batch(batch_of([message]), PAYLOADS)
        assert [message.sequence for message in recorder.latched.values()] == [2]


def test_messages_of_unknown_topics_in_a_batch_are_counted_and_not_written(tmp_path, flight):
    known = {noun: kind for noun, kind in PAYLOADS.items() if kind is not Wrench}
    wrenches = sum(isinstance(d.payload, Wrench) for d in flight)
    with Recorder(tmp_path / "a.mcap", EVERYTHING) as recorder:
        assert recorder.record_batch(batch_of(flight), known) == wrenches > 0
        assert recorder.message_count == len(flight) - wrenches
