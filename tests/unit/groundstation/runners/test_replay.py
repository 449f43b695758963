"""A replay tells nodes what they were told then; an unchanged node says the same, bit for bit."""

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import Journal, JournalWriter, Kind
from groundstation.declarations.errors import UsageError
from groundstation.declarations.node import Node
from groundstation.declarations.request import Request
from groundstation.declarations.topic import Scope
from groundstation.parts.control.messages import ControlStatus, Wrench
from groundstation.parts.imu.messages import ImuBytes
from groundstation.parts.operation.messages import Diagnostics
from groundstation.parts.stars.messages import StarImage
from groundstation.parts.table import installed_tables
from groundstation.recording.info import RecordingInfo
from groundstation.recording.policy import ImagePolicy
from groundstation.recording.reader import Recording
from groundstation.recording.recover import recover
from groundstation.recording.writer import Recorder
from groundstation.runners.replay import ReplayRunner, recorded_nodes
from groundstation.runners.tolerances import Tolerances

PAYLOADS = installed_tables().payloads
KINDS = PAYLOADS.values()
STEP_NS = 10_000_000
PROCESS = "alpha_flight"


class Adder(Node):
    """Adds up bytes with a gain: each answer depends on all that was heard before."""

    inputs = (ImuBytes, Request)
    outputs = (Wrench, Diagnostics, ControlStatus)
    gain = 1.0 / 3.0

    def __init__(self, vehicle):
        super().__init__(vehicle, tick_period_ns=5 * STEP_NS)
        self.sum = 0.0

    def start(self, now_ns):
        yield Diagnostics(now_ns, "", "adder", 0, "starting", (), ())

    def receive(self, message, now_ns):
        if isinstance(message, Request):
            self.sum = 0.0
            return
        self.sum += self.gain * sum(message.data) + 1e-9 * now_ns
        yield Wrench(message.stamp_ns, self.vehicle, self.sum, -0.0, float("nan"), 0.0, 0.0, self.sum / 7)

    def tick(self, now_ns):
        yield ControlStatus(now_ns, self.vehicle, "adder", (self.sum, 0.0), 0.0, float("inf"), 0.0, (), ())

    def stop(self, now_ns):
        yield Diagnostics(now_ns, "", "adder", 0, "stopping", (), ())


@dataclass
class Laboratory:
    """The least that runs and records a node: numbers, journal, publication."""

    recorder: Recorder
    late_ns: int = 0
    journal_first: bool = False
    lose: frozenset = frozenset()
    counts: dict = field(default_factory=dict)
    journal: JournalWriter = field(default_factory=JournalWriter)
    held: list = field(default_factory=list)

    def envelope(self, payload, now_ns):
        topic = payload.TOPIC
        owner = PROCESS if topic.scope is Scope.PROCESS else payload.vehicle
        number = self.counts[topic.noun, owner] = self.counts.get((topic.noun, owner), 0) + 1
        return Envelope(topic, owner, number, now_ns)

    def write(self, envelope, payload, log_ns):
        if (envelope.topic.noun, envelope.sequence) not in self.lose:
            self.recorder.record(Delivered(envelope, payload), log_ns)

    def call(self, node, kind, reported, now_ns, consumed=None):
        noun, owner, number = ("", PROCESS, 0)
        if consumed is not None:
            noun, owner, number = consumed.topic.noun, consumed.owner, consumed.sequence
        self.journal.note(kind, f"{node.vehicle}/adder", noun, owner, number, now_ns)
        for payload in reported:
            envelope = self.envelope(payload, now_ns + self.late_ns)
            self.journal.note(
                Kind.OUTPUT, f"{node.vehicle}/adder", envelope.topic.noun, envelope.owner,
                envelope.sequence, now_ns,
            )  # fmt: skip
            self.held.append((envelope, payload))

    def publish(self, now_ns):
        for envelope, payload in [item for item in self.held if item[0].publish_ns <= now_ns]:
            self.write(envelope, payload, now_ns)
        self.held = [item for item in self.held if item[0].publish_ns > now_ns]

    def hear(self, node, payload, now_ns):
        envelope = self.envelope(payload, now_ns)
        if self.journal_first:
            self.call(node, Kind.INPUT, node.receive(payload, now_ns), now_ns, envelope)
            self.say_journal(now_ns)
            self.write(envelope, payload, now_ns + STEP_NS // 2)
        else:
            self.write(envelope, payload, now_ns)
            self.call(node, Kind.INPUT, node.receive(payload, now_ns), now_ns, envelope)

    def say_journal(self, now_ns):
        names, entries = self.journal.take()
        payload = Journal(now_ns, "", PROCESS, names, entries)
        self.write(self.envelope(payload, now_ns), payload, now_ns)

    def fly(self, steps, begin=0, vehicles=("alpha", "bravo")):
        random = np.random.default_rng(3)
        nodes = [Adder(vehicle) for vehicle in vehicles]
        start_ns = (begin + 1) * STEP_NS
        for node in nodes:
            self.call(node, Kind.START, node.start(start_ns), start_ns)
        for step in range(begin, begin + steps):
            now_ns = (step + 1) * STEP_NS
            self.publish(now_ns)
            for node in nodes:
                self.hear(node, ImuBytes(now_ns, node.vehicle, random.bytes(9), math.nan), now_ns)
                if step % 13 == 7:
                    self.hear(node, Request(now_ns, node.vehicle, step, "test", "zero", ""), now_ns)
                if step % 5 == 4:
                    self.call(node, Kind.TICK, node.tick(now_ns), now_ns)
                if step % 6 == 1:
                    self.journal.note(
                        Kind.DROP, f"{node.vehicle}/adder", "imu_bytes", node.vehicle, 999, now_ns
                    )
                    self.journal.note(Kind.PORT, None, "imu_bytes", node.vehicle, 998, now_ns)
            self.publish(now_ns)
            if step % 10 == 9:
                self.say_journal(now_ns)
        end_ns = (begin + steps) * STEP_NS
        for node in nodes:
            self.call(node, Kind.STOP, node.stop(end_ns), end_ns)
        self.publish(end_ns + self.late_ns)
        self.say_journal(end_ns)


def fly(path, steps=60, info=RecordingInfo(), **options):  # noqa: B008 frozen
    with Recorder(path, info) as recorder:
        Laboratory(recorder, **options).fly(steps)
    return path


def replay(path, make=None, **options):
    def factory(key):
        vehicle, _, name = key.partition("/")
        assert name == "adder"
        return (make or Adder)(vehicle)

    with Recording(path) as recording:
        return ReplayRunner(recording, factory, **options).run()


def counts(report):
    return {(r.noun, r.owner): r.equal for r in report.results}


@pytest.fixture
def path(tmp_path):
    return fly(tmp_path / "flight.mcap")


ALL = {
    ("wrench", "alpha"): 60, ("wrench", "bravo"): 60,
    ("control_status", "alpha"): 12, ("control_status", "bravo"): 12,
    ("diagnostics", PROCESS): 4,
}  # fmt: skip


def test_an_unchanged_node_says_the_same_bit_for_bit(path):
    report = replay(path)
    assert report.agrees
    assert counts(report) == ALL
    assert report.nodes == ("alpha/adder", "bravo/adder")
    assert report.inputs == 2 * (60 + 5)
    assert report.ticks == 24


def test_the_replayed_file_holds_the_recorded_outputs(tmp_path, path):
    with Recorder(tmp_path / "again.mcap", RecordingInfo()) as output:
        replay(path, output=output)
    with Recording(path) as then, Recording(tmp_path / "again.mcap") as now:
        assert identified(then.messages(Adder.outputs)) == identified(now.messages(KINDS))
        assert {channel.noun for channel in now.channels} == {kind.TOPIC.noun for kind in Adder.outputs}


def identified(messages):
    """What was recorded, by name; a replay may write in another order."""
    return sorted(((r.envelope.topic.noun, r.envelope.owner, r.envelope.sequence), r.data) for r in messages)


def test_two_replays_give_equal_files(tmp_path, path):
    for name in ("a.mcap", "b.mcap"):
        with Recorder(tmp_path / name, RecordingInfo()) as output:
            replay(path, output=output)
    assert (tmp_path / "a.mcap").read_bytes() == (tmp_path / "b.mcap").read_bytes()


def test_one_vehicle_can_be_replayed_alone(path):
    report = replay(path, nodes=["bravo/adder"])
    assert report.agrees
    assert {owner for (_, owner) in counts(report)} == {"bravo", PROCESS}


def test_a_changed_node_is_found_with_field_and_sequence(path):
    class Changed(Adder):
        def receive(self, message, now_ns):
            for reported in super().receive(message, now_ns):
                if reported.stamp_ns < 21 * STEP_NS:
                    yield reported
                else:
                    yield Wrench(
                        reported.stamp_ns, reported.vehicle, reported.force_x_n, 0.0, 0.0, 0.0, 0.0, 9.0
                    )

    report = replay(path, Changed, nodes=["alpha/adder"])
    result = next(r for r in report.results if r.noun == "wrench")
    assert not report.agrees
    assert (result.equal, result.different) == (20, 40)
    assert result.first.field == "force_y_n"
    assert (result.first.recorded, result.first.replayed) == ("-0.0", "0.0")
    assert result.first.sequence == 21
    assert result.first.stamp_ns == 21 * STEP_NS


def test_tolerances_forgive_as_much_as_they_say(path):
    class Rounded(Adder):
        gain = 1.0 / 3.0 * (1 + 1e-14)

    tight = {"wrench": {"force_x_n": 1e-9, "torque_z_nm": 1e-9}}
    report = replay(
        path, Rounded, tolerances=Tolerances(tight | {"control_status": {"goal_position_table_m": 1e-9}})
    )
    assert report.agrees
    assert sum(r.close for r in report.results) > 50
    report = replay(path, Rounded, tolerances=Tolerances(tight))
    assert {r.noun for r in report.results if not r.agrees} == {"control_status"}


def test_silence_and_chatter_are_named(tmp_path, path):
    class Silent(Adder):
        def tick(self, now_ns):
            return ()

    class Chatty(Adder):
        def tick(self, now_ns):
            yield from super().tick(now_ns)
            yield from super().tick(now_ns)

    silent = next(r for r in replay(path, Silent).results if r.noun == "control_status")
    assert (silent.equal, silent.missing, silent.agrees) == (0, 12, False)
    with Recorder(tmp_path / "chatty.mcap", RecordingInfo()) as output:
        chatty = next(r for r in replay(path, Chatty, output=output).results if r.noun == "control_status")
    assert (chatty.equal, chatty.extra, chatty.agrees) == (12, 12, False)
    with Recording(tmp_path / "chatty.mcap") as now:
        sequences = [r.envelope.sequence for r in now.messages([ControlStatus], ["alpha"])]
    assert sorted(sequences) == [0] * 12 + list(range(1, 13))


def test_another_topic_than_recorded_is_a_difference(path):
    class Turned(Adder):
        def tick(self, now_ns):
            yield Diagnostics(now_ns, "", "adder", 0, "", (), ())

    result = next(r for r in replay(path, Turned).results if r.noun == "control_status")
    assert result.different == 12
    assert (result.first.field, result.first.replayed) == ("topic", "diagnostics")


def test_answers_that_were_published_late_are_compared_too(tmp_path):
    # the published star tracker answers 0.6 s after its frame: the journal is recorded before the answer
    report = replay(fly(tmp_path / "late.mcap", late_ns=600_000_000))
    assert report.agrees
    assert counts(report) == ALL


def test_an_input_that_the_recorder_logged_late_is_found(tmp_path):
    report = replay(fly(tmp_path / "skew.mcap", journal_first=True))
    assert report.agrees
    assert counts(report) == ALL


def test_an_input_that_was_lost_is_named(tmp_path):
    report = replay(fly(tmp_path / "lossy.mcap", lose=frozenset({("imu_bytes", 30)})))
    assert not report.agrees
    assert report.missing_inputs == {"alpha/adder <- imu_bytes": 1, "bravo/adder <- imu_bytes": 1}


def test_an_output_that_was_not_recorded_is_counted_and_no_difference(tmp_path):
    report = replay(fly(tmp_path / "lossy.mcap", lose=frozenset({("wrench", 30)})))
    assert report.agrees
    assert sum(r.unrecorded for r in report.results) == 2


def test_a_process_that_was_started_again_is_replayed_through_both_lives(tmp_path):
    # its counters begin at 1 again, as those of a process do that died
    path = tmp_path / "twice.mcap"
    with Recorder(path, RecordingInfo()) as recorder:
        Laboratory(recorder).fly(40)
        Laboratory(recorder).fly(60, begin=700)
    report = replay(path)
    assert report.agrees
    assert counts(report)["wrench", "alpha"] == 100


def test_a_recovered_recording_replays_as_far_as_its_journal_goes(tmp_path, path):
    torn = tmp_path / "torn.mcap.part"
    torn.write_bytes(path.read_bytes()[:4500])
    assert 0 < recover(torn, tmp_path / "torn.mcap").messages < 300
    report = replay(tmp_path / "torn.mcap")
    assert report.agrees
    assert 0 < counts(report)["wrench", "alpha"] < 60


def test_a_node_that_is_not_in_the_journal_is_refused_with_those_that_are(path):
    with pytest.raises(UsageError, match=r"'alpha/fuson'.*alpha/adder, bravo/adder"):
        replay(path, nodes=["alpha/fuson"])
    with Recording(path) as recording:
        assert recorded_nodes(recording) == ("alpha/adder", "bravo/adder")


def test_a_node_whose_images_were_not_kept_is_refused_in_one_sentence(tmp_path):
    class Looking(Adder):
        inputs = (StarImage,)

    path = fly(tmp_path / "spots.mcap", info=RecordingInfo(images=ImagePolicy.SPOTS))
    with pytest.raises(UsageError, match="alpha/adder cannot be replayed: it receives star_image"):
        replay(path, Looking, nodes=["alpha/adder"])
    with pytest.raises(UsageError, match="images = 'spots'"):
        replay(path, Looking)
    report = replay(path, lambda vehicle: Looking(vehicle) if vehicle == "bravo" else Adder(vehicle))
    assert report.nodes == ("alpha/adder",)
    assert "images = 'spots'" in report.refused["bravo/adder"]


def test_a_recording_without_a_journal_is_refused(tmp_path):
    with Recorder(tmp_path / "empty.mcap", RecordingInfo()):
        pass
    with pytest.raises(UsageError, match="no start of a node"):
        replay(tmp_path / "empty.mcap")


def begun_late(whole: Path, late: Path, start_ns: int) -> Path:
    """What a recorder has that was started in mid-flight."""
    with Recording(whole) as recording, Recorder(late, RecordingInfo()) as recorder:
        for r in recording.messages(KINDS, start_ns=start_ns):
            recorder.record_encoded(PAYLOADS[r.envelope.topic.noun], r.envelope, r.data, r.log_ns)
    return late


def test_a_recording_that_begins_in_mid_flight_is_refused(tmp_path, path):
    with pytest.raises(UsageError, match="no start of a node"):
        replay(begun_late(path, tmp_path / "late.mcap", 150_000_000))


def test_a_life_whose_start_was_not_recorded_is_left_out(tmp_path):
    path = tmp_path / "twice.mcap"
    with Recorder(path, RecordingInfo()) as recorder:
        Laboratory(recorder).fly(40)
        Laboratory(recorder).fly(60, begin=700)
    report = replay(begun_late(path, tmp_path / "late.mcap", 150_000_000))
    assert report.agrees
    assert report.before_start > 100
    assert counts(report) == ALL
