"""What outlives processes: text and back, the port, and the file."""

import json
import math
import os
import threading
from pathlib import Path

import pytest

from drivers.errors import DeviceError
from drivers.memory_file import MemoryFile
from groundstation.parts.supervision.memory import MemoryPort, memory_of, text_of
from groundstation.parts.supervision.messages import Recalled, Supervision
from groundstation.supervision.mode_machine import Memory, Then
from groundstation.supervision.modes import Mode

KEPT = Memory(Mode.BRAKING, True, False, Then.LAND, "stopped: brakes", "anna", 9)


def ruling(memory):
    return Supervision(
        5, "alpha", memory.mode, "brake", True, True, memory.is_stop_latched, math.inf,
        memory.is_flight_wanted, int(memory.then), memory.cause, memory.author, memory.since_ns, (),
        memory.latched,
    )  # fmt: skip


@pytest.mark.parametrize(
    "memory", [KEPT, Memory(Mode.RESTING, False, True, Then.FLY, "it has just begun", "", 9)]
)
def test_what_is_kept_is_what_is_recalled(memory):
    assert memory_of(Recalled(9, "alpha", text_of(ruling(memory)), "")) == memory


def test_where_nothing_was_kept_nothing_is_recalled():
    assert memory_of(Recalled(9, "alpha", "", "")) is None


def test_a_file_that_cannot_be_read_counts_as_a_stop():
    memory = memory_of(Recalled(9, "alpha", "", "no permission"))
    assert memory == Memory(Mode.LANDING, True, False, Then.LAND, "no permission", "", 9)


GOOD = json.loads(text_of(ruling(KEPT)))


@pytest.mark.parametrize(
    "content",
    [
        "{", "[]", "3", "null", "[" * 100_000, json.dumps({"mode": "landed"}),
        json.dumps(GOOD | {"mode": "gliding"}), json.dumps(GOOD | {"then": 7}),
        json.dumps(GOOD | {"then": None}), json.dumps(GOOD | {"mode": None}),
        json.dumps(GOOD | {"then": [1]}),
    ],
)  # fmt: skip
def test_a_text_that_makes_no_sense_counts_as_a_stop(content):
    memory = memory_of(Recalled(9, "alpha", content, ""))
    why = "what was kept of its last mode cannot be read"
    assert memory == Memory(Mode.LANDING, True, False, Then.LAND, why, "", 9)


class TestPort:
    def test_it_is_delivered_first_and_keeps_the_rulings_of_its_vehicle(self):
        port = MemoryPort("alpha/memory", "alpha", "station/memory")
        assert port.is_first
        assert port.reads is Recalled
        assert port.writes() == ((Supervision, "alpha"),)

    def test_what_is_read_becomes_a_message_and_a_ruling_a_text(self):
        port = MemoryPort("alpha/memory", "alpha", "station/memory")
        message = port.to_message(7, ("text", "trouble"))
        assert (message.stamp_ns, message.vehicle) == (7, "alpha")
        assert (message.content, message.trouble) == ("text", "trouble")
        assert port.to_device(ruling(KEPT)) == text_of(ruling(KEPT))

    def test_it_keeps_one_file_per_vehicle_in_its_folder(self, tmp_path):
        first = MemoryPort("alpha/memory", "alpha", str(tmp_path)).open()
        ((stamp_ns, data),) = first.read()
        assert data == ("", "")
        assert stamp_ns > 0
        first.write("kept")
        assert (tmp_path / "alpha.json").read_text().rstrip() == "kept"
        again = MemoryPort("alpha/memory", "alpha", str(tmp_path)).open()
        ((_, data),) = again.read()
        assert data == ("kept", "")
        again.wake()
        assert tuple(again.read()) == ()
        first.close()
        assert first._file._ending.is_set()  # who still reads returns
        assert tuple(first.read()) == ()


class TestFile:
    @pytest.fixture
    def path(self, tmp_path):
        return tmp_path / "alpha.json"

    def test_where_there_is_no_file_there_is_no_text(self, path):
        stamp_ns, text, trouble = MemoryFile(path).read(0.0)
        assert (text, trouble) == ("", "")
        assert stamp_ns > 0

    def test_what_was_written_is_read_by_the_next_process(self, path):
        MemoryFile(path).write("gelöscht")
        assert MemoryFile(path).read(0.0)[1:] == ("gelöscht", "")
        assert path.read_bytes().rstrip() == "gelöscht".encode()

    def test_it_is_read_once_and_then_waits(self, path):
        memory = MemoryFile(path)
        assert memory.read(0.0) is not None
        waiting = threading.Thread(target=memory.read, args=(60.0,))
        waiting.start()
        waiting.join(0.05)
        assert waiting.is_alive()
        memory.wake()
        waiting.join(10.0)
        assert not waiting.is_alive()
        assert memory.read(60.0) is None

    def test_a_file_that_is_no_text_is_a_trouble(self, path):
        path.write_bytes(b"\xff\xfe\xff")
        _, text, trouble = MemoryFile(path).read(0.0)
        assert text == ""
        assert trouble.startswith(f"{path} cannot be read: ")

    def test_a_file_that_is_a_folder_is_a_trouble(self, path):
        path.mkdir()
        assert "cannot be read" in MemoryFile(path).read(0.0)[2]

    def test_a_text_that_is_kept_already_is_not_written_again(self, path):
        memory = MemoryFile(path)
        memory.write("a")
        path.unlink()
        memory.write("a")
        assert not path.exists()
        memory.write("b")
        assert path.read_text().rstrip() == "b"

    def test_a_shorter_text_leaves_nothing_of_the_longer_one(self, path):
        memory = MemoryFile(path)
        memory.write("a" * 1000)
        memory.write("b")
        assert path.read_text().rstrip() == "b"
        assert [entry.name for entry in path.parent.iterdir()] == ["alpha.json"]

    def test_a_folder_that_is_not_there_is_said(self, path):
        memory = MemoryFile(path.parent / "absent" / "alpha.json")
        for _ in range(2):  # what failed is not taken for kept
            with pytest.raises(DeviceError, match="json cannot be written: No such file or directory"):
                memory.write("a")

    def test_it_is_forced_to_the_disk_and_the_handle_closed(self, path, monkeypatch):
        forced = threading.Event()
        handles = []
        real = os.fsync

        def fsync(handle):
            real(handle)
            target = Path(f"/proc/self/fd/{handle}").readlink()
            if target.is_relative_to(path.parent):  # threads of other tests force theirs
                handles.append(handle)
                forced.set()

        monkeypatch.setattr(os, "fsync", fsync)
        memory = MemoryFile(path)
        memory.write("a")
        assert forced.wait(10.0)
        memory._force()
        assert len(handles) == 2
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(handles[-1])

    def test_a_file_that_was_removed_meanwhile_needs_no_forcing(self, path):
        MemoryFile(path)._force()
        assert not path.exists()
