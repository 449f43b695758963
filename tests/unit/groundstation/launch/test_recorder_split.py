"""A live recording that is split: nothing is lost between files, each begins with what is latched."""

import queue

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.launch.recorder import begin_file, write_until_end
from groundstation.parts.operation.messages import CalibrationInUse, Latency
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.run_files import next_name
from tests.unit.groundstation.launch.test_recorder import Bus, batch_of

PAYLOADS = {"latency": Latency, "calibration": CalibrationInUse}
INFO = RecordingInfo()


def latched():
    batch = RecordWriter()
    message = CalibrationInUse(5, "alpha", "imu", "", "")
    batch.add(Envelope(CalibrationInUse.TOPIC, "alpha", 1, 5), codec_of(CalibrationInUse).encode(message))
    return batch.take()


def write(recorder, *batches):
    waiting = queue.SimpleQueue()
    for batch in (*batches, None):
        waiting.put(batch)
    assert write_until_end(recorder, waiting, Bus(), "recorder", PAYLOADS)


def test_when_its_time_is_over_a_file_ends_and_what_waits_is_left_for_the_next(tmp_path):
    waiting = queue.SimpleQueue()
    waiting.put(batch_of(1))
    recorder = begin_file(INFO, PAYLOADS, tmp_path / "recording.mcap")
    assert not write_until_end(recorder, waiting, Bus(), "recorder", PAYLOADS, until_ns=0)
    assert not waiting.empty()
    assert recorder.message_count == 0
    recorder.discard()


def test_files_of_a_split_run_are_read_as_one(tmp_path):
    first = tmp_path / "recording.mcap"
    recorder = begin_file(INFO, PAYLOADS, first)
    write(recorder, latched(), batch_of(1, 2))
    for number in (3, 4):
        following = begin_file(INFO, PAYLOADS, next_name(first), recorder)
        recorder.finish()
        recorder = following
        write(recorder, latched(), batch_of(number))
    recorder.finish()
    names = ["recording.mcap", "recording_1.mcap", "recording_2.mcap"]
    with Recording(tmp_path) as recording:
        assert [path.name for path in recording.files] == names
        assert [m.envelope.sequence for m in recording.messages([Latency])] == [1, 2, 3, 4]
        assert [m.envelope.publish_ns for m in recording.messages([CalibrationInUse])] == [5]
        assert recording.missing() == []
    for name in names[1:]:
        with Recording(tmp_path / name) as recording:
            (message,) = recording.messages([CalibrationInUse])
            assert message.envelope.publish_ns == 5
            assert message.log_ns > 5
