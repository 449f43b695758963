from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter, read_batch
from groundstation.parts.fusion.messages import VehicleState
from groundstation.runners.witness import WINDOW_NS, Witness


def test_it_testifies_to_the_last_moments_and_forgets_what_was_before():
    witness = Witness()
    period_ns = 10_000_000
    for sequence in range(1, 101):
        witness.keep(Envelope(VehicleState.TOPIC, "alpha", sequence, sequence * period_ns), bytes([sequence]))
    record = RecordWriter()
    witness.testify(record)
    found = list(read_batch(record.take()))
    first = 100 - WINDOW_NS // period_ns
    assert [entry.sequence for entry in found] == list(range(first, 101))
    assert [bytes(entry.data) for entry in found] == [bytes([n]) for n in range(first, 101)]
    assert {(entry.noun, entry.owner) for entry in found} == {("state", "alpha")}
