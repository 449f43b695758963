"""Holes at random places of a flight: what lies outside the damaged chunks comes back, bit for bit."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.parts.table import installed_tables
from groundstation.recording.reader import Recording
from groundstation.recording.recording_file import RecordingFile
from groundstation.recording.records import MESSAGE, Opcode, complete_records
from groundstation.recording.recover import recover
from groundstation.recording.summary import summary_of
from groundstation.recording.writer import Recorder

SOURCE = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"
KINDS = installed_tables().payloads.values()
HOLE = 4096
HOLES = st.lists(st.tuples(st.floats(0.0, 1.0), st.sampled_from([1, 40, HOLE]), st.booleans()), max_size=3)


def all_of(path):
    with Recording(path) as recording:
        return [
            (*m.envelope[1:4], m.envelope.topic.noun, m.data, m.log_ns) for m in recording.messages(KINDS)
        ]


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Bytes of a flight as the recorder of today writes them, its chunks, and the messages by chunk."""
    path = tmp_path_factory.mktemp("flown") / "run.mcap"
    with Recording(SOURCE) as source, Recorder(path, source.info) as recorder:
        for message in source.messages(KINDS, stop_ns=source.start_ns + 3_000_000_000):
            kind = installed_tables().payloads[message.envelope.topic.noun]
            recorder.record_encoded(kind, message.envelope, message.data, message.log_ns)
    data = path.read_bytes()
    file = RecordingFile(path)
    chunks = sorted(file.summary.chunks, key=lambda chunk: chunk.offset)
    inside = [list(in_chunk(file, chunk)) for chunk in chunks]
    file.close()
    messages = all_of(path)
    assert [m for rows in inside for m in rows] == messages
    return data, chunks, inside, messages


def in_chunk(file, chunk):
    data = file.unpacked(chunk)
    for opcode, start, stop in complete_records(data):
        if opcode == Opcode.MESSAGE:
            number, sequence, log_ns, publish_ns = MESSAGE.unpack_from(data, start)
            channel = file.channels[number]
            payload = data[start + MESSAGE.size : stop]
            yield channel.owner, sequence, publish_ns, channel.noun, payload, log_ns


@pytest.mark.parametrize("is_torn", [False, True], ids=["with its index", "without"])
def test_what_lies_outside_the_damaged_chunks_comes_back_in_order(flown, tmp_path, is_torn):
    data, chunks, inside, messages = flown
    end, everything = chunks[-1].offset + chunks[-1].length, set(messages)

    @settings(max_examples=15, deadline=None, derandomize=True)
    @given(HOLES)
    def check(holes):
        broken = bytearray(data[:end] if is_torn else data)
        places = []
        for share, size, is_noise in holes:
            place = round(share * (len(broken) - size))
            broken[place : place + size] = b"\xa5" * size if is_noise else bytes(size)
            places.append((place, place + size))
        source, target = tmp_path / "broken.mcap", tmp_path / "whole.mcap"
        source.write_bytes(broken)
        target.unlink(missing_ok=True)
        report = recover(source, target)
        found = all_of(target)
        damaged = [
            any(low < chunk.offset + chunk.length and high > chunk.offset for low, high in places)
            for chunk in chunks
        ]
        want = [m for rows, is_lost in zip(inside, damaged, strict=True) if not is_lost for m in rows]
        assert report.orphans == 0
        wanted, known = set(want), set(found)
        assert [m for m in found if m in wanted] == want
        assert known <= everything
        assert len(found) == len(known)

    check()


def test_provenance_survives_a_hole_at_either_copy(flown, tmp_path):
    data = flown[0]
    for place in [offset for offset, _ in summary_of(data).metadata_places]:
        broken = data[:place] + bytes(HOLE) + data[place + HOLE :]
        (tmp_path / "broken.mcap").write_bytes(broken)
        (tmp_path / "whole.mcap").unlink(missing_ok=True)
        recover(tmp_path / "broken.mcap", tmp_path / "whole.mcap")
        with Recording(tmp_path / "whole.mcap") as found, Recording(SOURCE) as source:
            assert found.info == source.info
