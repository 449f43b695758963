"""What an attendant that looks on is handed, and that it gives signs of life."""

import itertools
import socket
import threading
import time
from pathlib import Path

import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter, read_batch
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.declarations.lease import Lease
from groundstation.launch import onlooker
from groundstation.launch.onlooker import look_on
from groundstation.launch.orders import Orders
from groundstation.parts.operation.messages import Latency


@pytest.fixture
def hub():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with ZenohBus(endpoint, is_hub=True) as bus:
        yield endpoint, bus


def batch_of(*rows):
    writer = RecordWriter()
    for message, sequence in rows:
        envelope = Envelope(type(message).TOPIC, message.vehicle, sequence, 7)
        writer.add(envelope, codec_of(type(message)).encode(message))
    return writer.take()


def test_it_takes_each_message_once_and_latched_ones_again_and_gives_signs_of_life(hub, monkeypatch):
    endpoint, bus = hub
    stops, taken, signs = [], [], []
    monkeypatch.setattr(onlooker, "stop_when_asked", stops.append)
    monkeypatch.setattr(onlooker.os, "nice", lambda _by: None)
    bus.subscribe("record/viewer", lambda _key, batch, _attachment: signs.append(batch))
    latency = Latency(0, "alpha", (), (), ())
    lease = Lease(0, "", "anna", 1, "")

    def publish():
        for number in itertools.count(1):
            if stops and stops[0].__self__.is_set():
                return
            bus.publish_batch("flight", b"nonsense")
            bus.publish_batch("flight", batch_of((latency, number), (latency, number), (lease, 1)))
            time.sleep(0.01)  # who publishes does not wait for who looks on

    def take(recorded):
        taken.append((recorded.noun, recorded.sequence))
        if len(taken) > 60 and signs:
            stops[0]()

    publisher = threading.Thread(target=publish)
    publisher.start()
    look_on(Orders("viewer", Path("rig.toml"), "", endpoint), take, {"lease"})
    publisher.join()
    numbers = [sequence for noun, sequence in taken if noun == "latency"]
    assert numbers == sorted(set(numbers))
    assert taken.count(("lease", 1)) > 10
    assert list(read_batch(signs[0])) == []
