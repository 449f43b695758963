"""A whole live run of a rig: launcher, monitor and ledger; what the terminal view looks at."""

import os
import queue
import time
from collections.abc import Callable
from pathlib import Path

from groundstation.bus.topics import TOPICS, Recorded, topic_named, topic_of
from groundstation.messages import definitions as m
from groundstation.messages.cdr import CodecError
from groundstation.runtime.launcher import Launcher
from groundstation.runtime.monitor import Monitor
from groundstation.runtime.rig import Rig
from groundstation.runtime.running import RunningRig

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.zenoh_bus import split_key

LATENCY_PERIOD_S = 1.0
POLL_S = 0.05
_UNSEEN = (m.Journal, m.ImuRaw, m.FixBytes, m.ReferenceBytes, m.CanIn, m.CalibrationInUse)


class LiveRun:
    """Runs a rig live and keeps the monitor up to date.

    Args:
        rig: The rig.
        rig_path: Its file.
        recording: Where the recorder writes.
    """

    def __init__(self, rig: Rig, rig_path: Path, recording: Path) -> None:
        self.rig = rig
        self.recording = recording
        self.monitor = Monitor(tuple(rig.vehicles))
        self.launcher = Launcher(rig, rig_path, recording, self.monitor.say)
        self.started_s = time.monotonic()
        self._heard: queue.SimpleQueue[tuple[str, bytes, bytes]] = queue.SimpleQueue()
        self._latched: dict[tuple[str, str], int] = {}
        self._sequence = 0
        self._latency_due_s = 0.0
        self._announcement: Path | None = None

    @property
    def is_ready(self) -> bool:
        """Whether every process runs."""
        return self.launcher.is_ready

    def start(self, is_unwanted: Callable[[], bool]) -> None:
        """Start everything, unless the end is asked for meanwhile."""
        if is_unwanted():
            return
        self.launcher.start()
        run = RunningRig(os.getpid(), self.rig.name, self.launcher.endpoint, tuple(self.rig.vehicles))
        self._announcement = run.announce()
        bus = self.launcher.bus
        assert bus is not None
        for topic in TOPICS:
            if topic.payload not in _UNSEEN and topic.recorded is Recorded.ALWAYS:
                bus.subscribe(f"*/{topic.noun}", lambda *heard: self._heard.put(heard))
        bus.subscribe(f"*/{topic_of(m.Journal).noun}", lambda key, *_: self.launcher.heard(split_key(key)[0]))

    def step(self, duration_s: float) -> None:
        """Supervise and listen for a while."""
        until_s = time.monotonic() + duration_s
        while (now_s := time.monotonic()) < until_s:
            self.launcher.supervise()
            self._listen(min(until_s, now_s + POLL_S))
            if now_s >= self._latency_due_s:
                self._latency_due_s = now_s + LATENCY_PERIOD_S
                self._publish_latency()
                self.monitor.look(time.monotonic_ns())

    def close(self) -> None:
        """End everything in good order."""
        if self._announcement is not None:
            self._announcement.unlink(missing_ok=True)
        self.launcher.close()

    def _listen(self, until_s: float) -> None:
        while (left_s := until_s - time.monotonic()) > 0:
            try:
                key, data, attachment = self._heard.get(timeout=left_s)
            except queue.Empty:
                return
            owner, noun = split_key(key)
            topic = topic_named(noun)
            try:
                envelope = Envelope.unpack(topic, owner, attachment)
                payload = topic.codec.decode(data)
            except (CodecError, ValueError) as error:
                self.monitor.say(f"undecodable message on {key}: {error}")
                continue
            if topic.latched:
                if self._latched.get((owner, noun)) == envelope.sequence:
                    continue
                self._latched[owner, noun] = envelope.sequence
            self.monitor.take(Delivered(envelope, payload), time.monotonic_ns())

    def _publish_latency(self) -> None:
        bus = self.launcher.bus
        if bus is None:
            return
        topic = topic_of(m.Latency)
        now_ns = time.monotonic_ns()
        self._sequence += 1
        for vehicle in self.monitor.vehicles:
            summary = self.monitor.ledger.summary(vehicle, now_ns)
            self.monitor.vehicles[vehicle].newest[m.Latency] = summary
            envelope = Envelope(topic, vehicle, self._sequence, now_ns)
            bus.publish(envelope, topic.codec.encode(summary))
