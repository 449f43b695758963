"""What the recorder reports of itself, and a recording that ends in time on a disk that fills."""

import math
import queue

import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter, read_batch
from groundstation.launch.recorder import write_until_end
from groundstation.launch.recorder_pause import SPARE_BYTES
from groundstation.launch.recorder_reporter import RATE_WINDOW_NS, TOLD_NS, RecorderReporter
from groundstation.parts.operation.messages import Diagnostics, Latency, RecorderStatus
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder

INFO = RecordingInfo(rig_toml="", rig_path="", images=ImagePolicy.OFF, calibration_sha256={}, seed=None)
SECOND_NS = 1_000_000_000


class Bus:
    """Keeps what is published."""

    def __init__(self):
        self.at_once, self.health, self.batches = [], [], []

    def put(self, topic, owner, encoded, attachment):
        envelope = Envelope.of_attachment(topic, owner, attachment)
        if topic is Diagnostics.TOPIC:
            self.health.append((envelope, codec_of(Diagnostics).decode(encoded)))
        else:
            self.at_once.append((envelope, codec_of(RecorderStatus).decode(encoded)))

    def publish_batch(self, process, batch):
        self.batches.append((process, batch))


def batch_of(*sequences):
    writer = RecordWriter()
    for sequence in sequences:
        ages_s = tuple(map(math.sin, range(sequence, sequence + 20)))
        message = Latency(sequence, "alpha", ("fix",) * 20, ages_s, ages_s)
        envelope = Envelope(Latency.TOPIC, "alpha", sequence, sequence * SECOND_NS)
        writer.add(envelope, codec_of(Latency).encode(message))
    return writer.take()


def record(recorder, *sequences):
    recorder.record_batch(read_batch(batch_of(*sequences)), {"latency": Latency})
    recorder.tick(10**18)


def test_it_reports_at_once_and_twice_a_second_on_its_own_key_and_to_be_recorded(tmp_path):
    bus = Bus()
    with Recorder(tmp_path / "run.mcap", INFO) as recorder:
        reporter = RecorderReporter(recorder, bus, "recorder", 100, free=lambda _path: 5_000_000)
        for now_ms in range(0, 2000, 50):
            reporter.look(now_ms * 1_000_000)
    assert [envelope.sequence for envelope, _ in bus.at_once] == [101, 102, 103, 104]
    first = bus.at_once[0][1]
    assert (first.path, first.free_bytes) == (str(tmp_path / "run.mcap.part"), 5_000_000)
    assert first.room_s == math.inf
    recorded = [entry for process, batch in bus.batches for entry in read_batch(batch)]
    assert [(entry.noun, entry.owner, entry.sequence) for entry in recorded] == [
        ("recorder_status", "", 101),
        ("diagnostics", "recorder", 101),
        ("recorder_status", "", 102),
        ("recorder_status", "", 103),
        ("diagnostics", "recorder", 102),
        ("recorder_status", "", 104),
    ]
    assert {(health.level, health.summary) for _, health in bus.health} == {(0, "")}


def test_what_was_lost_is_told_at_once_and_for_some_seconds_after_recording_goes_on(tmp_path, monkeypatch):
    now_ns = SECOND_NS
    monkeypatch.setattr("time.monotonic_ns", lambda: now_ns)
    bus = Bus()
    with Recorder(tmp_path / "run.mcap", INFO) as recorder:
        reporter = RecorderReporter(recorder, bus, "recorder")
        reporter.look(now_ns)
        reporter.stall("it was deleted", is_full=False)
        reporter.look(now_ns)
        reporter.go_on(recorder)
        for now_ns in (2 * SECOND_NS, SECOND_NS + TOLD_NS - 1, SECOND_NS + TOLD_NS, 2 * SECOND_NS + TOLD_NS):
            reporter.look(now_ns)
    told = [(health.level, health.summary) for _, health in bus.health]
    assert told == [(0, ""), (2, "it was deleted"), (1, "it was deleted"), (1, "it was deleted"), (0, "")]


def test_a_disk_that_is_gone_keeps_the_recorder_from_nothing_but_writing(tmp_path):
    def gone(_recorder):
        raise RecordingError("its disk is gone")

    bus = Bus()
    with Recorder(tmp_path / "run.mcap", INFO) as recorder:
        reporter = RecorderReporter(recorder, bus, "recorder", free=gone)
        with pytest.raises(RecordingError, match="is gone"):
            reporter.look(0)
        reporter.stall("its disk is gone", is_full=False)
        assert reporter.look(0).free_bytes == 0
    assert [health.summary for _, health in bus.health] == ["its disk is gone"]


def test_the_room_is_what_is_free_at_the_rate_of_the_last_seconds(tmp_path):
    with Recorder(tmp_path / "run.mcap", INFO) as recorder:
        reporter = RecorderReporter(recorder, Bus(), "recorder", free=lambda _path: 10_000_000)
        before = reporter.look(0)
        record(recorder, *range(1, 200))
        after = reporter.look(2 * SECOND_NS)
        rate = (after.written_bytes - before.written_bytes) / 2.0
        assert rate > 1_000
        assert after.room_s == pytest.approx((10_000_000 - recorder.rest_bytes) / rate)
        quiet_ns = 2 * SECOND_NS + RATE_WINDOW_NS
        assert reporter.look(quiet_ns).room_s == math.inf, "nothing was written in the last seconds"


def test_on_a_disk_that_fills_it_ends_in_time_and_the_file_is_whole(tmp_path):
    disk = SPARE_BYTES + 60_000
    recorder = Recorder(tmp_path / "run.mcap", INFO, spare_bytes=SPARE_BYTES)
    reporter = RecorderReporter(recorder, Bus(), "recorder", free=lambda _path: disk - recorder.written_bytes)

    def fill():
        waiting = queue.SimpleQueue()
        for number in range(1, 100_000, 50):
            waiting.put(batch_of(*range(number, number + 50)))
            waiting.put(None)
            reporter._due_ns = 0
            write_until_end(recorder, waiting, Bus(), "recorder", {"latency": Latency}, reporter)

    with pytest.raises(RecordingError, match="the disk is full"):
        fill()
    recorder.finish()
    assert (tmp_path / "run.mcap").stat().st_size < disk
    with Recording(tmp_path / "run.mcap") as recording:
        assert len(list(recording.delivered([Latency], ["alpha"]))) > 100


@pytest.mark.parametrize("messages", [0, 1, 500, 20_000])
def test_what_is_left_to_write_is_never_underestimated(tmp_path, messages):
    recorder = Recorder(tmp_path / "run.mcap", INFO, flush_period_ns=SECOND_NS)
    for begin in range(0, messages, 500):
        rows = range(begin + 1, min(begin + 500, messages) + 1)
        recorder.record_batch(read_batch(batch_of(*rows)), {"latency": Latency})
    before, rest = recorder.written_bytes, recorder.rest_bytes
    size = recorder.finish().stat().st_size
    assert before <= size <= before + rest
