"""Our files are, byte for byte, those of the library that everybody reads them with."""

import io
import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from groundstation.recording import mcap_file
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.written_chunks import WrittenChunks

LIMIT = 2000
MESSAGES = st.lists(
    st.tuples(
        st.integers(0, 2), st.integers(0, 1 << 62), st.binary(max_size=900), st.integers(0, 0xFFFFFFFF)
    ),
    max_size=25,
)


def ours(messages, flushes):
    file = io.BytesIO()
    out = McapFile(file, "ros2", "test")
    out.add_metadata("about", {"seed": "3", "text": "é"})
    channels = {}
    for number, (which, log_ns, data, sequence) in enumerate(messages):
        if which not in channels:
            schema = out.add_schema(f"kind_{which}", "ros2msg", b"float64 x\n" * (which + 1))
            channels[which] = out.add_channel(f"/topic_{which}", "cdr", schema)
        out.add_message(channels[which], log_ns, data, log_ns // 2, sequence)
        if number in flushes:
            out.flush()
    out.finish()
    return file.getvalue()


def theirs(messages, flushes):
    file = io.BytesIO()
    out = Writer(file, chunk_size=LIMIT, compression=CompressionType.ZSTD)
    out.start(profile="ros2", library="test")
    out.add_metadata("about", {"seed": "3", "text": "é"})
    channels = {}
    for number, (which, log_ns, data, sequence) in enumerate(messages):
        if which not in channels:
            schema = out.register_schema(f"kind_{which}", "ros2msg", b"float64 x\n" * (which + 1))
            channels[which] = out.register_channel(f"/topic_{which}", "cdr", schema)
        out.add_message(channels[which], log_ns, data, log_ns // 2, sequence)
        if number in flushes:
            out.flush()
    out.finish()
    return file.getvalue()


@pytest.fixture(scope="module", autouse=True)
def small_chunks():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mcap_file, "CHUNK_BYTES", LIMIT)
        patch.setattr(mcap_file, "LEVEL", 3)  # the library's
        yield


@given(messages=MESSAGES, flushes=st.sets(st.integers(0, 24), max_size=4))
def test_a_file_is_the_one_that_the_library_would_write(messages, flushes):
    assert ours(messages, flushes) == theirs(messages, flushes)


@pytest.mark.parametrize("chunks", [63, 64, 65, 300])
def test_a_file_of_many_chunks_is_the_librarys_too(chunks):
    """What is kept of chunks until the end is packed in batches."""
    messages = [(i % (1 + i % 3), 1000 + i, bytes([i % 256]) * (i % 70), i + 1) for i in range(3 * chunks)]
    flushes = set(range(2, 3 * chunks, 3))
    assert ours(messages, flushes) == theirs(messages, flushes)


def test_the_library_reads_every_message_by_its_index():
    messages = [(i % 3, 1000 + i, bytes([i]) * 300, i + 1) for i in range(40)]
    found = list(make_reader(io.BytesIO(ours(messages, {7}))).iter_messages(topics=["/topic_1"]))
    assert [(m.log_time, m.publish_time, m.sequence, m.data) for _, _, m in found] == [
        (log_ns, log_ns // 2, sequence, data) for which, log_ns, data, sequence in messages if which == 1
    ]


def test_an_hour_of_chunks_is_kept_in_little_memory():
    """Fifteen thousand chunks of fifty channels: their index records take nine megabytes in the file."""
    out = WrittenChunks("zstd")
    tracemalloc.start()
    try:
        for number in range(15_000):
            messages = {channel: 1 + (number + channel) % 3 for channel in range(1, 51)}
            out.add(40_000 * number, (31_000 + number % 700, 30_000, 90_000), (number, number + 9), messages)
        kept, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert kept < 2_000_000
    assert sum(map(len, out.records())) > 8_000_000
