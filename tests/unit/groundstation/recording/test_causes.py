import pytest

from groundstation.bus.envelope import Cause, Delivered, Envelope
from groundstation.bus.journal import Journal, JournalWriter, Kind
from groundstation.recording.causes import CauseIndex
from groundstation.recording.errors import RecordingError
from groundstation.recording.info import RecordingInfo
from groundstation.recording.reader import Recording
from groundstation.recording.writer import Recorder

IMU_BYTES, IMU, STATE, WRENCH, DEMAND = "imu_bytes", "imu", "state", "wrench", "valve_demand"


def recording_with(journal: JournalWriter, tmp_path):
    path = tmp_path / "run.mcap"
    topic = Journal.TOPIC
    names, entries = journal.take()
    with Recorder(path, RecordingInfo()) as recorder:
        payload = Journal(1000, "", "lockstep", names, entries)
        recorder.record(Delivered(Envelope(topic, "lockstep", 1, 1000), payload), 1000)
    return Recording(path)


@pytest.fixture
def index(tmp_path):
    journal = JournalWriter()
    for number in (1, 2):
        now_ns = 100 * number
        journal.note(Kind.PORT, None, IMU_BYTES, "alpha", number, now_ns)
        journal.note(Kind.INPUT, "alpha/imu_reader", IMU_BYTES, "alpha", number, now_ns)
        journal.note(Kind.OUTPUT, "alpha/imu_reader", IMU, "alpha", number, now_ns, 7)
        journal.note(Kind.INPUT, "alpha/fusion", IMU, "alpha", number, now_ns)
        journal.note(Kind.OUTPUT, "alpha/fusion", STATE, "alpha", number, now_ns)
        journal.note(Kind.INPUT, "alpha/controller", STATE, "alpha", number, now_ns)
    journal.note(Kind.INPUT, "alpha/controller", STATE, "bravo", 9, 240)
    journal.note(Kind.TICK, "alpha/controller", "", "lockstep", 0, 250)
    journal.note(Kind.OUTPUT, "alpha/controller", WRENCH, "alpha", 1, 250)
    journal.note(Kind.INPUT, "alpha/controller", DEMAND, "alpha", 7, 260)
    journal.note(Kind.OUTPUT, "alpha/controller", WRENCH, "alpha", 2, 260)
    with recording_with(journal, tmp_path) as recording:
        yield CauseIndex(recording)


def test_a_message_said_while_handling_an_input_was_triggered_by_it(index):
    origin = index[Cause(IMU, "alpha", 2)]
    assert origin.causes == (Cause(IMU_BYTES, "alpha", 2),)
    assert (origin.node, origin.given_ns, origin.wall_ns) == ("alpha/imu_reader", 200, 7)


def test_a_message_said_in_a_tick_comes_from_the_newest_inputs_of_each_vehicle(index):
    newest = (Cause(STATE, "alpha", 2), Cause(STATE, "bravo", 9))
    assert index[Cause(WRENCH, "alpha", 1)].causes == newest


def test_an_answer_comes_from_what_it_answers_first_and_then_from_the_newest_other_inputs(index):
    newest = (Cause(STATE, "alpha", 2), Cause(STATE, "bravo", 9))
    assert index[Cause(WRENCH, "alpha", 2)].causes == (Cause(DEMAND, "alpha", 7), *newest)


def test_the_chain_leads_from_a_command_back_to_the_bytes(index):
    chain = [(steps, origin.message) for steps, origin in index.chain(Cause(WRENCH, "alpha", 1))]
    assert chain == [
        (0, Cause(WRENCH, "alpha", 1)),
        (1, Cause(STATE, "alpha", 2)),
        (2, Cause(IMU, "alpha", 2)),
        (3, Cause(IMU_BYTES, "alpha", 2)),
    ]


def test_a_message_that_no_journal_names_is_refused_by_name(index):
    with pytest.raises(RecordingError, match="alpha/wrench number 9"):
        index[Cause(WRENCH, "alpha", 9)]


def test_a_recording_without_journals_is_refused(tmp_path):
    path = tmp_path / "empty.mcap"
    with Recorder(path, RecordingInfo()):
        pass
    with Recording(path) as recording, pytest.raises(RecordingError, match="holds no journal"):
        CauseIndex(recording)


def test_a_journal_that_points_nowhere_is_refused_with_file_and_channel(tmp_path):
    path = tmp_path / "run.mcap"
    with Recorder(path, RecordingInfo()) as recorder:
        payload = Journal(1000, "", "lockstep", ("a", "b"), bytes(22) + b"\7\0")
        recorder.record(Delivered(Envelope(Journal.TOPIC, "lockstep", 1, 1000), payload), 1000)
    with Recording(path) as recording, pytest.raises(RecordingError) as refused:
        CauseIndex(recording)
    assert str(refused.value) == (
        f"{path}: /lockstep/journal holds a damaged message (Journal: an entry points to name 7 of 2)"
    )
