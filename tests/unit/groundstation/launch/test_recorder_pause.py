"""A recorder whose disk fills: the file is whole, the flight is told, recording goes on in another."""

import errno
import itertools
import math
import os
import queue

import pytest

from groundstation.launch.recorder import write_until_end
from groundstation.launch.recorder_pause import ROOM_AGAIN_BYTES, SPARE_BYTES, Pause
from groundstation.launch.recorder_reporter import RecorderReporter
from groundstation.parts.operation.messages import Latency
from groundstation.recording import disk_file
from groundstation.recording.errors import NoRoomError, RecordingError
from groundstation.recording.reader import Recording
from groundstation.recording.run_files import next_name
from groundstation.recording.writer import Recorder
from tests.unit.groundstation.launch.test_recorder_reporter import INFO, Bus, batch_of, record

PAYLOADS = {"latency": Latency}


def begin(path):
    return Recorder(path, INFO, spare_bytes=SPARE_BYTES)


class Disk:
    """Takes so many bytes and no more, as an operating system does: it cuts the last piece."""

    def __init__(self, monkeypatch, room):
        self.room = room

        class File(disk_file.DiskFile):
            def _put(file, data):  # noqa: N805
                place, end = file.tell(), os.fstat(file.fileno()).st_size
                fits = min(len(data), max(0, end + self.room - place))
                if not fits:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                written = super(File, file)._put(data[:fits])
                self.room -= max(0, place + written - end)
                return written

        monkeypatch.setattr(disk_file, "DiskFile", File)


def sequences(path):
    with Recording(path) as recording:
        return [row.envelope.sequence for row in recording.delivered([Latency], ["alpha"])]


def fill(recorder):
    """Record until the disk takes no more; the numbers that were given to it."""
    for number in itertools.count(1):
        try:
            record(recorder, *range(50 * number, 50 * number + 50))
        except RecordingError:
            return list(range(50, 50 * number + 50))
    raise AssertionError


@pytest.mark.parametrize("room", [20_000, 33_333, 50_000, 77_777, 100_001])
def test_what_a_full_disk_has_taken_is_whole_and_is_finished_when_there_is_room_again(
    tmp_path, monkeypatch, room
):
    disk = Disk(monkeypatch, room)
    recorder = Recorder(tmp_path / "run.mcap", INFO)
    given = fill(recorder)
    pause = Pause(recorder, tmp_path / "run.mcap", begin, free=lambda _path: disk.room)
    if not pause.words().endswith("is complete up to here"):  # not even the index found room
        assert "recover brings back" in pause.words()
        assert pause.try_to_go_on() is None
    disk.room = ROOM_AGAIN_BYTES + 1_000_000
    following = pause.try_to_go_on()
    assert following is not None
    assert pause.words() == f"{tmp_path / 'run.mcap'} is complete up to here"
    found = sequences(tmp_path / "run.mcap")
    assert found == given[: len(found)]
    assert len(given) - len(found) <= 100, "no more than what was in memory is lost"
    assert following.path == tmp_path / "run_1.mcap"
    record(following, *range(9000, 9050))
    following.finish()
    assert sequences(tmp_path / "run_1.mcap") == list(range(9000, 9050))
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run.mcap", "run_1.mcap"]


def test_a_recording_that_ends_in_time_is_whole(tmp_path, monkeypatch):
    free = SPARE_BYTES + 60_000
    monkeypatch.setattr(disk_file.DiskFile, "free_bytes", lambda file: free - file.tell())
    recorder = Recorder(tmp_path / "run.mcap", INFO, spare_bytes=SPARE_BYTES)
    assert len(fill(recorder)) > 100
    with pytest.raises(NoRoomError, match="the disk is full"):
        recorder.check_room(free - recorder.written_bytes)
    recorder.finish()
    assert (tmp_path / "run.mcap").stat().st_size < 60_000 + SPARE_BYTES // 2
    assert len(sequences(tmp_path / "run.mcap")) > 100


def test_while_it_waits_it_is_alive_and_reports_no_room(tmp_path, monkeypatch):
    monkeypatch.setattr("groundstation.launch.recorder_pause.RETRY_NS", 0)
    room = iter([0, 0, ROOM_AGAIN_BYTES])
    recorder = Recorder(tmp_path / "run.mcap", INFO)
    bus, waiting = Bus(), queue.SimpleQueue()
    reporter = RecorderReporter(recorder, bus, "recorder", free=lambda _path: 0)
    reporter.stall()
    for item in (batch_of(1), b"nonsense", batch_of(2)):
        waiting.put(item)
    pause = Pause(recorder, tmp_path / "run.mcap", begin, free=lambda _path: next(room))
    following = pause.wait(waiting, bus, "recorder", reporter)
    assert following.path == tmp_path / "run_1.mcap"
    assert bus.at_once[0][1].room_s == 0.0
    assert any(process == "recorder" for process, _ in bus.batches)
    reporter.go_on(following)
    waiting.put(batch_of(77))
    waiting.put(None)
    write_until_end(following, waiting, bus, "recorder", PAYLOADS)
    following.finish()
    assert sequences(tmp_path / "run_1.mcap")[-1] == 77


def test_asked_to_end_it_ends_and_leaves_no_litter(tmp_path):
    recorder = Recorder(tmp_path / "run.mcap", INFO)
    waiting = queue.SimpleQueue()
    waiting.put(None)
    pause = Pause(recorder, tmp_path / "run.mcap", begin, free=lambda _path: 0)
    assert pause.wait(waiting, Bus(), "recorder", RecorderReporter(recorder, Bus(), "recorder")) is None
    assert pause.words() == f"{tmp_path / 'run.mcap'} is not begun"
    assert not list(tmp_path.iterdir()), "a recording without a message leaves no file"


def test_a_file_that_was_deleted_is_never_called_complete(tmp_path):
    recorder = Recorder(tmp_path / "run.mcap", INFO)
    record(recorder, 1, 2)
    recorder.part_path.unlink()
    pause = Pause(recorder, tmp_path / "run.mcap", begin, is_full=False)
    assert pause.words() == "What it held is lost."
    following = pause.try_to_go_on()
    assert following.path == tmp_path / "run_1.mcap"
    following.discard()
    assert not list(tmp_path.iterdir())


def test_a_complete_file_that_goes_later_is_not_called_complete_any_more(tmp_path):
    recorder = Recorder(tmp_path / "run.mcap", INFO)
    record(recorder, 1)
    pause = Pause(recorder, tmp_path / "run.mcap", begin)
    assert pause.words() == f"{tmp_path / 'run.mcap'} is complete up to here"
    (tmp_path / "run.mcap").rename(tmp_path / "other.mcap")
    assert pause.words() == f"{tmp_path / 'run.mcap'} was complete and is gone since"


def test_where_the_folder_was_moved_recording_goes_on_where_it_was_asked_for(tmp_path):
    (tmp_path / "a").mkdir()
    recorder = Recorder(tmp_path / "a" / "run.mcap", INFO)
    record(recorder, 1)
    (tmp_path / "a").rename(tmp_path / "b")
    pause = Pause(recorder, tmp_path / "a" / "run.mcap", begin)
    assert pause.words() == f"{tmp_path / 'b' / 'run.mcap'} is complete up to here"
    following = pause.try_to_go_on()
    record(following, 2)
    assert sequences(following.finish()) == [2]
    assert sequences(tmp_path / "b" / "run.mcap") == [1]


def test_a_next_file_that_need_not_be_waited_for_loses_nothing_that_waits(tmp_path):
    recorder = Recorder(tmp_path / "run.mcap", INFO)
    record(recorder, 1)
    recorder.part_path.unlink()
    bus, waiting = Bus(), queue.SimpleQueue()
    waiting.put(batch_of(2))
    reporter = RecorderReporter(recorder, bus, "recorder")
    pause = Pause(recorder, tmp_path / "run.mcap", begin, is_full=False, at_once=True)
    reporter.stall("run.mcap.part was deleted", is_full=False)
    following = pause.wait(waiting, bus, "recorder", reporter)
    assert [health.summary for _, health in bus.health] == ["run.mcap.part was deleted"]
    assert bus.at_once[0][1].room_s == math.inf, "there is room"
    waiting.put(None)
    write_until_end(following, waiting, bus, "recorder", PAYLOADS)
    assert sequences(following.finish()) == [2]


def test_a_name_that_is_taken_is_never_written_over(tmp_path):
    first = tmp_path / "run.mcap"
    assert next_name(first) == tmp_path / "run_1.mcap"
    (tmp_path / "run_1.mcap").touch()
    (tmp_path / "run_2.mcap.part").touch()
    assert next_name(first) == tmp_path / "run_3.mcap"
