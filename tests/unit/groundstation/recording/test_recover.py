"""A killed recorder leaves a file from which every readable message comes back, wherever it is cut."""

import contextlib
import io
import re
import struct
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from groundstation.bus.cdr import codec_of
from groundstation.bus.ros_schema import ENCODING, schema_text
from groundstation.cli.main import call
from groundstation.parts.imu.messages import ImuBytes
from groundstation.parts.table import installed_tables
from groundstation.recording.errors import NothingRecoveredError, RecordingError
from groundstation.recording.gaps import GAPS_NAME, Gap, from_metadata
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.recording.writer import Recorder

EVERYTHING = installed_tables().payloads.values()
INFO = RecordingInfo("name = 'two mock-ups'\n", images=ImagePolicy.LOSSLESS, seed=5)


@pytest.fixture(scope="module")
def whole(tmp_path_factory, small_flight):
    """Bytes of a finished recording of several chunks."""
    path = tmp_path_factory.mktemp("whole") / "a.mcap"
    with Recorder(path, INFO) as recorder:
        for delivered in small_flight(60):
            recorder.record(delivered, delivered.envelope.publish_ns)
    return path.read_bytes()


def messages(path):
    with Recording(path) as recording:
        assert recording.info == INFO
        return [(r.envelope, r.data, r.log_ns) for r in recording.messages(EVERYTHING)]


def readable(data: bytes) -> int:
    """Messages that the reference reader finds in the complete chunks of a torn file."""
    count = 0
    with contextlib.suppress(McapError, EOFError, ValueError, struct.error):
        for record in StreamReader(io.BytesIO(data)).records:
            count += isinstance(record, Message)
    return count


def recovered(folder, data: bytes):
    source, target = folder / "torn.mcap.part", folder / "recovered.mcap"
    source.write_bytes(data)
    target.unlink(missing_ok=True)
    return recover(source, target), target


def chunk_ends(data: bytes) -> list[int]:
    """Where complete chunks end: the places at which what is readable changes."""
    reader = make_reader(io.BytesIO(data))
    indexes = reader.get_summary().chunk_indexes
    return [index.chunk_start_offset + index.chunk_length for index in indexes]


def test_every_cut_gives_back_a_prefix_with_no_readable_message_lost(tmp_path, whole):
    report, target = recovered(tmp_path, whole)
    everything = messages(target)
    assert report.was_finished
    assert report.torn_bytes == 0
    first = whole.index(b"groundstation", 40) + 1200  # behind the provenance
    ends = chunk_ends(whole)
    assert len(ends) > 2

    @settings(max_examples=60, deadline=None, derandomize=True)
    @given(st.integers(first, len(whole)) | st.sampled_from([e + d for e in ends for d in (-1, 0, 1)]))
    def check(cut):
        try:
            report, target = recovered(tmp_path, whole[:cut])
        except NothingRecoveredError:
            assert readable(whole[:cut]) == 0
            return
        found = messages(target)
        assert found == everything[: len(found)]
        assert len(found) >= readable(whole[:cut])
        assert report.messages == len(found)
        assert report.damaged_chunks == report.orphans == 0

    check()


def test_a_cut_in_the_head_leaves_nothing_to_recover(tmp_path, whole):
    for cut in range(0, 600, 7):
        (tmp_path / "x.part").write_bytes(whole[:cut])
        with pytest.raises(RecordingError, match="no MCAP" if cut < 8 else "nothing could be recovered"):
            recover(tmp_path / "x.part", tmp_path / "x.mcap")
        assert [path.name for path in tmp_path.iterdir()] == ["x.part"]


def spoilt(whole, how):
    return {
        "a lost beginning": bytes(200) + whole[200:],
        "a lost magic": bytes(8) + whole[8:],
        "a torn file without its beginning": bytes(200) + whole[200 : chunk_ends(whole)[1]],
        "a torn file": whole[: chunk_ends(whole)[1]],
        "a head alone": whole[:60],
        "zeros": whole[:8] + bytes(5000) + whole[-8:],
        "text": b"no recording" * 400,
        "nothing": b"",
    }[how]


@pytest.mark.parametrize(
    ("how", "sentence"),
    [
        ("a lost beginning", "is damaged at its beginning: try `groundstation recording recover`"),
        ("a lost magic", "is damaged at its beginning: try `groundstation recording recover`"),
        (
            "a torn file without its beginning",
            "is damaged at its beginning: try `groundstation recording recover`",
        ),
        ("a torn file", "was not finished or is damaged: try `groundstation recording recover`"),
        ("a head alone", "was not finished or is damaged: nothing in it can be recovered"),
        ("zeros", "was not finished or is damaged: nothing in it can be recovered"),
        ("text", "is no MCAP file"),
        ("nothing", "is no MCAP file"),
    ],
)
def test_what_a_reader_advises_is_what_a_recovery_can_do(how, sentence, tmp_path, whole, capsys):
    source, target = tmp_path / "spoilt.mcap", tmp_path / "new.mcap"
    source.write_bytes(spoilt(whole, how))
    assert call(["recording", "info", str(source)]) == 2
    assert capsys.readouterr().err.rstrip().endswith(sentence)
    code = call(["recording", "recover", str(source), "--out", str(target)])
    assert target.exists() == ("try" in sentence) == (code == 0)
    assert code == {"try `": 0, "nothi": 1}.get(sentence.partition(": ")[2][:5], 2)


def shuffled(whole):
    """Chunks of a recording in the order last, second, first, without an index; the second is damaged."""
    ends = chunk_ends(whole)
    summary = make_reader(io.BytesIO(whole)).get_summary()
    places = [(index.chunk_start_offset, end) for index, end in zip(summary.chunk_indexes, ends, strict=True)]
    first, second, *_, last = (bytearray(whole[start:end]) for start, end in places)
    second[-40] ^= 0x10
    return whole[: places[0][0]] + bytes(last + second + first)


def test_gaps_of_chunks_in_any_order_lie_within_the_recording_and_run_forward(tmp_path, whole, capsys):
    report, target = recovered(tmp_path, shuffled(whole))
    (gap,) = report.gaps
    assert gap.after_ns <= gap.before_ns
    with Recording(target) as recording:
        assert report.start_ns == recording.start_ns <= gap.after_ns
        assert gap.before_ns <= recording.stop_ns
        (sentence,) = recording.missing()
    assert "-" not in sentence


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
def test_the_torn_chunk_itself_gives_what_its_compressor_had_finished(tmp_path, compression, small_flight):
    # one chunk of more than a compressor's block: the reference reader would lose all of it
    file = io.BytesIO()
    writer = Writer(file, chunk_size=1 << 30, compression=compression)
    writer.start(profile="ros2")
    schema = writer.register_schema(ImuBytes.ROS_TYPE, ENCODING, schema_text(ImuBytes).encode())
    channel = writer.register_channel("/alpha/imu_bytes", "cdr", schema)
    payload = small_flight(1)[0]
    data = codec_of(ImuBytes).encode(payload.payload)
    for number in range(8000):
        writer.add_message(channel, number, data + number.to_bytes(3, "little"), number, number)
    writer.finish()
    cut = file.getvalue()[: chunk_ends(file.getvalue())[0] - 10]
    assert readable(cut) == 0
    report, target = recovered(tmp_path, cut)
    assert 4000 < report.messages < 8000
    with Recording(target) as recording:
        assert [r.envelope.sequence for r in recording.messages(EVERYTHING)] == list(range(report.messages))


def test_a_file_without_chunks_is_recovered_too(tmp_path, small_flight):
    file = io.BytesIO()
    writer = Writer(file, use_chunking=False)
    writer.start()
    channel = writer.register_channel("/alpha/imu_bytes", "cdr", 0)
    for number in range(5):
        writer.add_message(channel, number, bytes(50), number, number)
    report, _ = recovered(tmp_path, file.getvalue()[:-20])
    assert report.messages == 4
    assert report.torn_bytes == 9 + 22 + 50 - 20


def test_a_damaged_chunk_costs_itself_and_its_neighbours_live(tmp_path, whole):
    second = chunk_ends(whole)[1]
    broken = bytearray(whole)
    broken[second - 40] ^= 0x10
    report, target = recovered(tmp_path, bytes(broken))
    assert report.damaged_chunks == 1
    assert report.orphans == 0
    lost = {m for m in complete(whole) if m not in set(messages(target))}
    inside = chunk_spans(whole)[1]
    assert {inside[0] <= log_ns <= inside[1] for _, _, log_ns in lost} == {True}


def complete(data: bytes):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "w.mcap"
        path.write_bytes(data)
        return messages(path)


def chunk_spans(data: bytes) -> list[tuple[int, int]]:
    chunks = [r for r in StreamReader(io.BytesIO(data), emit_chunks=True).records if isinstance(r, Chunk)]
    return [(chunk.message_start_time, chunk.message_end_time) for chunk in chunks]


def test_channels_named_in_a_damaged_chunk_are_found_in_the_index(tmp_path, whole):
    broken = bytearray(whole)
    broken[chunk_ends(whole)[0] - 40] ^= 0x10
    report, target = recovered(tmp_path, bytes(broken))
    assert report.damaged_chunks == 1
    assert report.orphans == 0  # the index at the end repeats the channels
    assert messages(target)


def test_channels_named_in_a_damaged_chunk_are_found_in_the_copies_behind_it(tmp_path, whole):
    ends, spans = chunk_ends(whole), chunk_spans(whole)
    broken = bytearray(whole)
    broken[ends[0] - 40] ^= 0x10
    report, target = recovered(tmp_path, bytes(broken[: ends[2]]))
    assert (report.damaged_chunks, report.orphans) == (1, 0)
    found, everything = messages(target), complete(whole)
    behind = [m for m in everything if spans[0][1] < m[2] < spans[2][1]]
    there = set(behind)
    assert [m for m in found if m in there] == behind
    assert set(found) <= set(everything)


def test_channels_that_no_other_chunk_names_are_counted(tmp_path):
    file = io.BytesIO()
    writer = Writer(file)
    writer.start(profile="ros2")
    schema = writer.register_schema(ImuBytes.ROS_TYPE, ENCODING, schema_text(ImuBytes).encode())
    channel = writer.register_channel("/alpha/imu_bytes", "cdr", schema)
    for number in range(6):
        writer.add_message(channel, number, bytes(50), number, number)
        if number == 2:
            writer.flush()
            end = file.tell()
    writer.flush()
    broken = bytearray(file.getvalue())
    broken[end - 150] ^= 0x10
    with pytest.raises(NothingRecoveredError, match="the channel of 3 messages is lost"):
        recovered(tmp_path, bytes(broken))


def test_zeros_that_a_power_cut_left_are_no_records(tmp_path, whole):
    cut = chunk_ends(whole)[1]
    report, target = recovered(tmp_path, whole[:cut] + bytes(4096))
    assert report.messages == readable(whole[:cut]) == len(messages(target))
    assert report.torn_bytes == 4096


def test_the_source_stays_and_nothing_is_overwritten(tmp_path, whole):
    report, target = recovered(tmp_path, whole[:-100])
    assert report.messages > 0
    assert (tmp_path / "torn.mcap.part").read_bytes() == whole[:-100]
    with pytest.raises(RecordingError, match="already there"):
        recover(tmp_path / "torn.mcap.part", target)
    with pytest.raises(RecordingError, match="No such file"):
        recover(tmp_path / "nothing.part", tmp_path / "n.mcap")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["recovered.mcap", "torn.mcap.part"]


def test_a_torn_or_garbled_file_is_read_or_refused_in_one_sentence(tmp_path, whole):
    path = tmp_path / "garbled.mcap"

    @settings(max_examples=150, deadline=None, derandomize=True)
    @given(
        st.integers(0, len(whole)),
        st.lists(st.tuples(st.integers(1, 1500), st.integers(0, 255)), max_size=4),
    )
    def check(cut, noise):
        data = bytearray(whole)
        for place, value in noise:
            data[-place] = value  # the index is at the end
        if not noise:
            del data[cut:]
        path.write_bytes(data)
        with contextlib.suppress(RecordingError), Recording(path) as recording:
            list(recording.messages(EVERYTHING))

    check()


@pytest.mark.parametrize("broken_chunks", [{0}, {1}, {1, 2}, {0, 2}, {-1}], ids=str)
def test_what_was_left_out_is_stated_in_the_recovered_file_for_good(tmp_path, whole, broken_chunks, capsys):
    ends, spans = chunk_ends(whole), chunk_spans(whole)
    places = {number % len(ends) for number in broken_chunks}
    broken = bytearray(whole)
    for number in places:
        broken[ends[number] - 40] ^= 0x10
    report, target = recovered(tmp_path, bytes(broken))
    assert sum(gap.chunks for gap in report.gaps) == report.damaged_chunks == len(places)
    runs = sorted(number for number in places if number - 1 not in places)
    assert len(report.gaps) == len(runs)
    for gap, first in zip(report.gaps, runs, strict=True):
        last = first + gap.chunks - 1
        assert gap.after_ns == (spans[first - 1][1] if first else None)
        assert gap.before_ns == (spans[last + 1][0] if last + 1 < len(spans) else None)
    with Recording(target) as recording:
        assert recording.gaps == tuple(report.gaps)
        sentences = recording.missing()
    assert call(["recording", "info", str(target)]) == 0
    shown = capsys.readouterr().out
    assert all(sentence in shown for sentence in sentences)
    again = tmp_path / "again.mcap"
    recover(target, again)
    with Recording(again) as recording:
        assert recording.missing() == sentences


def test_a_recording_without_gaps_states_none(tmp_path, whole):
    _, target = recovered(tmp_path, whole)
    with Recording(target) as recording:
        assert recording.gaps == ()
    assert GAPS_NAME.encode() not in target.read_bytes()


@pytest.mark.parametrize(
    ("gap", "sentence"),
    [
        (Gap(1, 8_200_000_000, 8_500_000_000), "1 damaged chunk was left out between 3.2 s and 3.5 s:"),
        (Gap(2, None, 8_500_000_000), "2 damaged chunks were left out before 3.5 s: what was in them is"),
        (Gap(1, 8_200_000_000, None), "1 damaged chunk was left out after 3.2 s: what was in it is missing"),
        (Gap(3, None, None), "3 damaged chunks were left out and nothing else was there: what was in them"),
    ],
)  # fmt: skip
def test_a_gap_is_one_sentence(gap, sentence):
    assert gap.sentence(5_000_000_000).startswith(sentence)


@pytest.mark.parametrize("text", ["{", "5", "[5]", "[[1, 2]]", '[["a", 1, 2]]', "[[1, 2, 3, 4]]"])
def test_gaps_that_cannot_be_read_are_refused(text):
    with pytest.raises(RecordingError, match=re.escape("groundstation.gaps")):
        from_metadata({"gaps": text})
