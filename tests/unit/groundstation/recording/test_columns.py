"""Columns of a recording are its messages, whatever the sizes of its chunks and the age of its schemas."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.cdr_columns import columns_of
from groundstation.parts.fusion.messages import VehicleState
from groundstation.parts.imu.messages import Imu
from groundstation.parts.reference.messages import ReferenceState
from groundstation.parts.valves.messages import ValveCommand
from groundstation.recording import columns
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.summary import read_summary

RECORDED = Path(__file__).parents[3] / "replay" / "recordings" / "formation.mcap"
WANTED = {
    VehicleState: ("position_table_m", "pose_sigma", "status", "fix_stamp_ns"),
    ReferenceState: ("heading_rad",),
    ValveCommand: ("on_time_ms", "gate"),
    Imu: ("frames_lost",),
}


def check(recording, found):
    assert {kind for kind, _ in found} == set(WANTED)
    for (kind, owner), rows in found.items():
        payloads = [message.payload for message in recording.messages([kind], [owner])]
        expected = columns_of(payloads, WANTED[kind])
        assert len(rows) > 50
        np.testing.assert_array_equal(rows.stamp_ns, expected.stamp_ns)
        for name in WANTED[kind]:
            np.testing.assert_array_equal(rows[name], expected[name])


@pytest.mark.parametrize("batch_bytes", [1, 1 << 23])
def test_columns_are_the_messages(batch_bytes, monkeypatch):
    monkeypatch.setattr(columns, "BATCH_BYTES", batch_bytes)
    with Recording(RECORDED) as recording:
        check(recording, columns.read_columns(recording, WANTED))


def test_a_file_with_another_layout_is_decoded_by_its_own_schema(monkeypatch):
    monkeypatch.setattr(columns, "schema_text", lambda kind: "not that of the file")
    with Recording(RECORDED) as recording:
        check(recording, columns.read_columns(recording, WANTED))


def with_a_hole(path, place, size=4096):
    data = bytearray(RECORDED.read_bytes())
    data[place : place + size] = bytes(size)
    path.write_bytes(data)
    return path


def chunk_in_the_middle():
    with RECORDED.open("rb") as file:
        chunks = read_summary(file.fileno(), RECORDED.stat().st_size).chunks
    return chunks[len(chunks) // 2]


def test_a_hole_in_the_indexes_between_two_chunks_costs_nothing(tmp_path):
    chunk = chunk_in_the_middle()
    begin = chunk.offset + chunk.length
    for place in np.linspace(begin, begin + chunk.index_length - 64, 12).astype(int).tolist():
        path = with_a_hole(tmp_path / "damaged.mcap", place, min(4096, begin + chunk.index_length - place))
        with Recording(path) as recording:
            check(recording, columns.read_columns(recording, WANTED))
        with Recording(path) as damaged, Recording(RECORDED) as whole:
            assert [m.data for m in damaged.messages(WANTED)] == [m.data for m in whole.messages(WANTED)]


def test_a_chunk_that_is_damaged_is_named(tmp_path):
    chunk = chunk_in_the_middle()
    path = with_a_hole(tmp_path / "damaged.mcap", chunk.offset + chunk.length // 2)
    with Recording(path) as recording, pytest.raises(RecordingError, match=r"damaged\.mcap: .* try"):
        columns.read_columns(recording, WANTED)
