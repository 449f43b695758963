"""The record stream's thread: batches in order, and a loss that is reported."""

import threading

from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.parts.fusion.messages import VehicleState
from groundstation.runners import record_sender
from groundstation.runners.record_sender import RecordSender


class SlowBus:
    """Takes one batch, and the others once it may."""

    def __init__(self):
        self.may_go_on = threading.Event()
        self.batches = []

    def publish_batch(self, process, batch):
        self.may_go_on.wait(5.0)
        self.batches.append((process, batch))


def batch_of(sequence, size):
    writer = RecordWriter()
    writer.add(Envelope(VehicleState.TOPIC, "alpha", sequence, sequence), bytes(size))
    return writer


def test_batches_leave_in_order():
    bus = SlowBus()
    bus.may_go_on.set()
    sender = RecordSender(bus, "alpha_flight")
    expected = [("alpha_flight", batch_of(sequence, 10).take()) for sequence in range(20)]
    for sequence in range(20):
        sender.send(batch_of(sequence, 10))
    sender.close()
    assert bus.batches == expected


def test_batches_that_are_too_many_are_dropped_and_reported_once_and_at_the_end(monkeypatch, capsys):
    monkeypatch.setattr(record_sender, "MOST_BYTES", 2500)
    bus = SlowBus()
    sender = RecordSender(bus, "alpha_flight")
    for sequence in range(5):
        sender.send(batch_of(sequence, 1000))
    first = capsys.readouterr().err
    bus.may_go_on.set()
    sender.close()
    assert sender.dropped == 3
    assert len(bus.batches) == 2
    assert first.count("\n") == 1
    assert first.startswith("not recorded: ")
    assert "3 batches" in capsys.readouterr().err
