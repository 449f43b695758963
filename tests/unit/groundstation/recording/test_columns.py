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


def test_a_chunk_that_is_damaged_is_named(tmp_path):
    path = tmp_path / "damaged.mcap"
    data = bytearray(RECORDED.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 20_000] = bytes(20_000)  # longer than the indexes between two chunks
    path.write_bytes(data)
    with Recording(path) as recording, pytest.raises(RecordingError, match=r"damaged\.mcap: .* try"):
        columns.read_columns(recording, WANTED)
