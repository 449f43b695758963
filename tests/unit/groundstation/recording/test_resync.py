"""A recording with zeros, noise or wrong lengths anywhere in it gives back all that is readable."""

import io

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer

from groundstation.cli.main import call
from groundstation.parts.table import installed_tables
from groundstation.recording.channel_names import parse_channel
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.recording.resync import Lost, walk
from groundstation.recording.writer import Recorder

EVERYTHING = installed_tables().payloads.values()
INFO = RecordingInfo("name = 'two mock-ups'\n", images=ImagePolicy.LOSSLESS, seed=5)
HOLE = 4096


@pytest.fixture(scope="module")
def whole(tmp_path_factory, small_flight):
    """Bytes of a finished recording of dozens of chunks, some smaller than the hole."""
    path = tmp_path_factory.mktemp("whole") / "a.mcap"
    with Recorder(path, INFO, flush_period_ns=50_000_000) as recorder:
        for delivered in small_flight(300):
            recorder.record(delivered, delivered.envelope.publish_ns)
    return path.read_bytes()


@pytest.fixture(scope="module")
def chunks(whole):
    """Span in the file of each chunk, and the names of its messages."""
    summary = make_reader(io.BytesIO(whole)).get_summary()
    inside = [r for r in StreamReader(io.BytesIO(whole), emit_chunks=True).records if isinstance(r, Chunk)]
    found = []
    for index, chunk in zip(summary.chunk_indexes, inside, strict=True):
        names = {
            (*parse_channel(summary.channels[record.channel_id].topic), record.sequence)
            for record in breakup_chunk(chunk)
            if isinstance(record, Message)
        }
        start = index.chunk_start_offset
        found.append((start, start + index.chunk_length, names))
    return found


def everything(path):
    with Recording(path) as recording:
        found = [(r.envelope, r.data, r.log_ns) for r in recording.messages(EVERYTHING)]
    return [((e.topic.noun, e.owner, e.sequence), data, log_ns) for e, data, log_ns in found]


@pytest.fixture(scope="module")
def messages(whole, tmp_path_factory):
    path = tmp_path_factory.mktemp("all") / "a.mcap"
    path.write_bytes(whole)
    return everything(path)


def recovered(folder, data):
    source, target = folder / "broken.mcap", folder / "recovered.mcap"
    source.write_bytes(data)
    target.unlink(missing_ok=True)
    return recover(source, target), target


def outside(messages, chunks, low, high):
    """Messages of the chunks that the bytes from low to high do not touch, and how many they touch."""
    spoilt = [names for start, stop, names in chunks if start < high and stop > low]
    return [m for m in messages if not any(m[0] in names for names in spoilt)], len(spoilt)


@pytest.mark.parametrize("size", [1, 40, HOLE])
def test_a_hole_anywhere_costs_the_chunks_that_it_touches_and_no_other(
    tmp_path, whole, chunks, messages, size
):
    head, end = chunks[0][0], chunks[-1][1]
    assert len(chunks) > 40
    for low in np.linspace(head, end - size, 60).astype(int).tolist():
        broken = whole[:low] + bytes(size) + whole[low + size :]
        report, target = recovered(tmp_path, broken)
        want, spoilt = outside(messages, chunks, low, low + size)
        assert everything(target) in (want, messages), low  # a zero may stand where one was
        assert report.orphans == 0
        assert report.damaged_chunks <= spoilt


@pytest.mark.parametrize("filling", ["zeros", "noise", "a length that leads beyond"])
def test_a_broken_index_costs_nothing(tmp_path, whole, chunks, messages, filling):
    end = chunks[-1][1]
    random = np.random.default_rng(1)
    for low in np.linspace(end, len(whole) - 64, 25).astype(int).tolist():
        size = {"zeros": len(whole) - low, "noise": 64, "a length that leads beyond": 9}[filling]
        new = {
            "zeros": bytes(size),
            "noise": random.bytes(size),
            "a length that leads beyond": b"\x08" + (1 << 30).to_bytes(8, "little"),
        }[filling]
        _, target = recovered(tmp_path, whole[:low] + new + whole[low + size :])
        assert everything(target) == messages, low


def test_a_wrong_length_does_not_lead_away_from_the_chunks_behind_it(tmp_path, whole, chunks, messages):
    random = np.random.default_rng(2)
    for start, stop, _ in chunks[::7]:
        for length in (0, 17, stop - start + 1000, int(random.integers(1 << 40)), 1 << 63):
            broken = whole[: start + 1] + length.to_bytes(8, "little") + whole[start + 9 :]
            _, target = recovered(tmp_path, broken)
            assert everything(target) == outside(messages, chunks, start, stop)[0], (start, length)


def test_a_torn_recording_with_a_hole_gives_what_is_before_and_behind_it(tmp_path, whole, chunks, messages):
    cut = chunks[-3][1]
    low = chunks[10][0] + 20
    report, target = recovered(tmp_path, whole[:low] + bytes(HOLE) + whole[low + HOLE : cut])
    want, _ = outside(messages, chunks, low, low + HOLE)
    torn = chunks[-2][2] | chunks[-1][2]
    assert everything(target) == [m for m in want if m[0] not in torn]
    assert report.gaps
    assert not report.was_finished


def test_a_hole_at_the_beginning_costs_what_it_covers_and_no_provenance(tmp_path, whole, chunks, messages):
    _, target = recovered(tmp_path, bytes(HOLE) + whole[HOLE:])
    with Recording(target) as recording:
        assert recording.info == INFO  # it stands in the file twice
    assert everything(target) == outside(messages, chunks, 0, HOLE)[0]


def test_what_is_no_recording_at_all_is_refused(tmp_path):
    random = np.random.default_rng(3)
    for data in (b"", b"x", bytes(50_000), random.bytes(50_000), b"name = 1\n" * 4000):
        with pytest.raises(RecordingError, match="is no MCAP file"):
            recovered(tmp_path, data)
        assert [path.name for path in tmp_path.iterdir()] == ["broken.mcap"]


def test_messages_without_chunks_are_found_behind_a_hole_too(tmp_path, small_flight):
    file = io.BytesIO()
    writer = Writer(file, use_chunking=False)
    writer.start()
    channel = writer.register_channel("/alpha/imu_bytes", "cdr", 0)
    for number in range(2000):
        writer.add_message(channel, number, number.to_bytes(4, "little") + bytes(30), number, number)
    writer.finish()
    data = file.getvalue()
    report, target = recovered(tmp_path, data[:20_000] + bytes(HOLE) + data[20_000 + HOLE :])
    lost = HOLE // 65 + 4
    assert 2000 - lost <= report.messages <= 2000 - HOLE // 65
    del small_flight
    assert sum(1 for _ in StreamReader(io.BytesIO(target.read_bytes())).records) > report.messages // 1000


def test_every_byte_is_a_record_or_lost_once(whole):
    random = np.random.default_rng(4)
    for _ in range(20):
        broken = bytearray(whole)
        for place in random.integers(8, len(whole), 30).tolist():
            broken[place] ^= int(random.integers(1, 256))
        position = 8
        for piece in walk(bytes(broken), 8):
            start = piece.start if isinstance(piece, Lost) else piece.start - 9
            assert start == position
            position = piece.stop
        assert position in (len(broken), len(broken) - 8)


def test_the_command_says_what_was_passed_over(tmp_path, whole, chunks, capsys):
    low = chunks[20][0]
    (tmp_path / "a.mcap").write_bytes(whole[:low] + bytes(HOLE) + whole[low + HOLE :])
    words = ["recording", "recover", str(tmp_path / "a.mcap"), "--out", str(tmp_path / "b.mcap")]
    assert call(words) == 0
    shown = capsys.readouterr().out
    assert " bytes within are no record: passed over" in shown
    assert "damaged chunk" in shown
    assert call(["recording", "info", str(tmp_path / "b.mcap")]) == 0
