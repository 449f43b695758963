"""A run that is none: a real hub, announced as runs are, on which a test publishes."""

import os
import socket
import subprocess
import sys

import pytest

from groundstation.bus.cdr import codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import RecordWriter
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.launch.running import RunningRig


class FakeRun:
    """Publishes what it is given as the record stream of a process, and lets commands look at it."""

    def __init__(self, hub, run, folder):
        self.hub, self.run, self.folder = hub, run, folder
        self._sequence = 0

    def publish(self, *messages, owner=None):
        batch = RecordWriter()
        for message in messages:
            self._sequence += 1
            envelope = Envelope(
                type(message).TOPIC, message.vehicle if owner is None else owner, self._sequence, 0
            )
            batch.add(envelope, codec_of(type(message)).encode(message))
        self.hub.publish_batch("flight", batch.take())

    def command(self, *words, **options):
        """Start a command in a process of its own."""
        return subprocess.Popen(
            [sys.executable, "-m", "groundstation", *words],
            env=os.environ | {"XDG_RUNTIME_DIR": str(self.folder)},
            text=True,
            **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options,
        )


@pytest.fixture
def fake_run(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    run = RunningRig(os.getpid(), "a rig", endpoint, ("alpha", "beta"))
    with ZenohBus(endpoint, is_hub=True) as hub:
        announcement = run.announce()
        yield FakeRun(hub, run, tmp_path)
        announcement.unlink(missing_ok=True)
