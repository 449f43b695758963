"""The recorder's loop: what it writes, drops and names, and a disk that is full."""

import os
import queue
import subprocess
import sys
from pathlib import Path

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter, read_batch
from groundstation.launch.recorder import write_until_end
from groundstation.parts.operation.messages import Latency
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.recording.writer import Recorder

INFO = RecordingInfo(rig_toml="", rig_path="", images=ImagePolicy.OFF, calibration_sha256={}, seed=None)


class Bus:
    """Keeps what is published."""

    def __init__(self):
        self.batches = []

    def publish_batch(self, process, batch):
        self.batches.append((process, batch))


def batch_of(*sequences):
    writer = RecordWriter()
    for sequence in sequences:
        message = Latency(sequence, "alpha", ("fix",), (0.1,), (0.2,))
        envelope = Envelope(Latency.TOPIC, "alpha", sequence, sequence * 1_000)
        writer.add(envelope, codec_of(Latency).encode(message))
    return writer.take()


def record_batches(recorder, *batches):
    bus, waiting = Bus(), queue.SimpleQueue()
    for batch in (*batches, None):
        waiting.put(batch)
    write_until_end(recorder, waiting, bus, "recorder", {"latency": Latency})
    return bus


def record(path, *batches):
    with Recorder(path, INFO) as recorder:
        return record_batches(recorder, *batches)


def test_batches_are_written_in_their_order(tmp_path):
    record(tmp_path / "run.mcap", batch_of(1, 2), batch_of(3))
    with Recording(tmp_path / "run.mcap") as recording:
        rows = list(recording.delivered([Latency], ["alpha"]))
    assert [row.envelope.sequence for row in rows] == [1, 2, 3]
    assert [row.payload.stamp_ns for row in rows] == [1, 2, 3]


def test_an_empty_batch_of_its_own_is_its_sign_of_life(tmp_path):
    bus = record(tmp_path / "run.mcap")
    ((process, batch),) = bus.batches
    assert process == "recorder"
    assert list(read_batch(batch)) == []


def test_what_is_no_batch_is_named_and_the_rest_is_written(tmp_path, capsys):
    record(tmp_path / "run.mcap", b"nonsense", batch_of(1)[:-1], batch_of(7))
    with Recording(tmp_path / "run.mcap") as recording:
        (row,) = recording.delivered([Latency], ["alpha"])
    assert row.envelope.sequence == 7
    assert capsys.readouterr().err.count("not recorded") == 2


ON_A_FULL_DISK = """
import os, resource, sys
from pathlib import Path
from groundstation.launch.process import obey
from groundstation.launch.recorder import in_a_sentence
from groundstation.recording.recover import recover
from groundstation.recording.writer import Recorder
from tests.unit.groundstation.launch.test_recorder import INFO, batch_of, record_batches

resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))

def work(path):
    recorder = Recorder(path, INFO)
    with in_a_sentence(recorder):
        for begin in range(0, 100_000, 100):
            record_batches(recorder, batch_of(*range(begin, begin + 100)))

obey(work, Path(sys.argv[1]))
"""


def test_a_full_disk_ends_it_with_one_sentence_and_what_was_written_stays(tmp_path):
    path = tmp_path / "run.mcap"
    root = Path(__file__).parents[4]
    done = subprocess.run(
        [sys.executable, "-c", ON_A_FULL_DISK, str(path)],
        capture_output=True,
        text=True,
        check=False,
        cwd=root,
        env=os.environ | {"PYTHONPATH": str(root)},
    )
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"{path}.part cannot be written any further: File too large (after ")
    recover(path.with_name("run.mcap.part"), tmp_path / "whole.mcap")
    with Recording(tmp_path / "whole.mcap") as recording:
        assert next(iter(recording.delivered([Latency], ["alpha"]))).envelope.sequence == 0


def test_a_recording_that_a_full_disk_lets_nobody_begin_leaves_no_file(tmp_path):
    script = (
        "import resource, signal, sys, pathlib; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "from groundstation.recording.writer import Recorder;"
        "from groundstation.recording.info import RecordingInfo;"
        "from groundstation.recording.policy import ImagePolicy;"
        "info = RecordingInfo('name = 1', '', ImagePolicy.OFF, {}, None);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4, 4));"
        "Recorder(pathlib.Path(sys.argv[1]), info)"
    )
    ended = subprocess.run(
        [sys.executable, "-c", script, str(tmp_path / "run.mcap")], capture_output=True, text=True
    )
    assert ended.returncode == 1
    assert ended.stderr.splitlines()[-1] == (
        "groundstation.recording.errors.NoRoomError: "
        f"{tmp_path / 'run.mcap.part'} cannot be written any further: File too large"
    )
    assert list(tmp_path.iterdir()) == []
