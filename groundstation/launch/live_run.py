"""A whole live run of a rig: launcher, monitor and latency; what the terminal view looks at."""

import math
import os
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.envelope import Envelope
from groundstation.bus.record_stream import BatchError, Recorded, RecordWriter, read_batch
from groundstation.bus.zenoh_bus import RECORD, Mailbox, split_key
from groundstation.declarations.errors import GroundStationError
from groundstation.declarations.names import LAUNCHER
from groundstation.declarations.rig import Rig
from groundstation.launch.attendant import Attendant
from groundstation.launch.guests import Guests
from groundstation.launch.launcher import START_S, Launcher
from groundstation.launch.recorder_troubles import closing_lines, final_trouble, why_stopped
from groundstation.launch.running import RunningRig
from groundstation.launch.running_time import RunningTime
from groundstation.parts.operation.messages import Latency, RecorderStatus
from groundstation.watch.fault_summary import FaultSummary
from groundstation.watch.monitor import Monitor

LATENCY_PERIOD_S = 1.0
POLL_S = 0.05
MOST_BATCHES = 4096
"""Of record streams, half a minute's; a launcher that is kept from looking for longer loses the oldest."""
READY_S = 2 * START_S
"""What is not ready by then never will be: the laboratory has its time, then its processes have theirs."""
STOOD_STILL_S = 2.0
"""It looks twenty times a second; a busy machine keeps it from that for less, a pause (Ctrl-Z) for longer."""
PROCESS = LAUNCHER
"""Whose record stream the latency is in."""


class LiveRun:
    """Runs a rig live and keeps the monitor up to date.

    Args:
        rig: The rig.
        rig_text: What its file reported when the rig was read.
        rig_path: The file.
        recording: Where the recorder writes.
        watchers: By noun: take the messages of a topic besides, encoded.
        hub_port: Of the hub on loopback; 0 for a free one.
        attendants: Processes beside the rig's.
        guests: Where programs of other hosts connect; None: nowhere.

    Attributes:
        recordings: Names of the first file, where it was asked for and in each folder to which it was moved.
    """

    def __init__(
        self,
        rig: Rig,
        rig_text: str,
        rig_path: Path,
        recording: Path,
        watchers: Mapping[str, Callable[[Recorded], None]] = MappingProxyType({}),
        hub_port: int = 0,
        attendants: Iterable[Attendant] = (),
        guests: Guests | None = None,
    ) -> None:
        self.rig = rig
        self.recordings = [recording]
        self.monitor = Monitor(rig.tables, tuple(rig.vehicles))
        self.launcher = Launcher(
            rig,
            rig_text,
            rig_path,
            recording,
            self.monitor.note,
            hub_port=hub_port,
            attendants=attendants,
            guests=guests,
        )
        self.started_s = time.monotonic()
        self.faults = FaultSummary(tuple(rig.vehicles), time.monotonic_ns())
        self._watchers = {RecorderStatus.TOPIC.noun: self._see_recorder, **watchers}
        self._nouns = frozenset(self._watchers) | frozenset(self.monitor.nouns)
        self._batches: Mailbox | None = None
        self._latching = {noun for noun, kind in rig.tables.payloads.items() if kind.TOPIC.latched}
        self._latched: dict[tuple[str, str], int] = {}
        self._sequence = 0
        self._latency_due_s = 0.0
        self._looked_s = math.inf  # never yet
        self._starting = RunningTime()
        self._announced: RunningRig | None = None
        self._announcement: Path | None = None

    @property
    def is_ready(self) -> bool:
        """Whether every process runs."""
        return self.launcher.is_ready

    @property
    def recording_trouble(self) -> str:
        """Why the recording was not written to its end; known after ``close``, empty where it was."""
        return final_trouble(self.launcher.recorder, self.started_s)

    @property
    def recorder_lines(self) -> list[str]:
        """What else went wrong with the recorder, for people; complete after ``close``."""
        return list(closing_lines(self.launcher.recorder, self.started_s))

    def start(self, is_unwanted: Callable[[], bool]) -> None:
        """Start everything, unless the end is asked for meanwhile."""
        if is_unwanted():
            return
        self.launcher.start()
        self._announced = RunningRig(
            os.getpid(),
            self.rig.name,
            self.launcher.endpoint,
            tuple(self.rig.vehicles),
            str(self.recordings[0].absolute()),
        )
        self._announcement = self._announced.announce()
        bus = self.launcher.bus
        assert bus is not None
        self._batches = bus.collect(f"{RECORD}/*", MOST_BATCHES)

    def step(self, duration_s: float) -> float:
        """Supervise and take what is published for a while; return how long the process stood still, s."""
        until_s = time.monotonic() + duration_s
        stood_s = 0.0
        while (now_s := time.monotonic()) < until_s:
            stood_s += self._note_pause(now_s)
            self._take()
            self.launcher.supervise()
            self._announce_recorder()
            if now_s >= self._latency_due_s:
                self._latency_due_s = now_s + LATENCY_PERIOD_S
                self._publish_latency()
                self.monitor.look(time.monotonic_ns())
            time.sleep(min(POLL_S, max(until_s - time.monotonic(), 0.0)))  # all at once costs least
        return stood_s + self._note_pause(now_s)

    def check_start(self) -> None:
        """Call where nobody watches who could end a run that does not get ready.

        Raises:
            GroundStationError: It is not ready in the time that the laboratory and the processes have.
        """
        if not self.is_ready and self._starting.step(time.monotonic()) > READY_S:
            names = ", ".join(self.launcher.waiting_for)
            raise GroundStationError(f"the rig is not ready after {READY_S:g} s: {names} did not start")

    def close(self) -> None:
        """End everything in good order."""
        if self._announcement is not None:
            self._announcement.unlink(missing_ok=True)
        self.launcher.close()

    def _note_pause(self, now_s: float) -> float:
        """How long the process stood still before this look, s; 0 where it did not. It goes to the events."""
        still_s, self._looked_s = now_s - self._looked_s, now_s
        if still_s < STOOD_STILL_S:
            return 0.0
        self.monitor.note(
            f"the run stood still for {still_s:.1f} s, paused or kept from the processor: "
            "its processes received nothing from each other"
        )
        return still_s

    def _take(self) -> None:
        """Let the monitor have what has come; each batch is a sign of life."""
        if self._batches is None:
            return
        now_ns = time.monotonic_ns()
        for key, batch in self._batches.take():
            process = split_key(key)[1]
            if process == PROCESS:
                continue
            self.launcher.received(process)
            try:
                entries = read_batch(batch, self._nouns)
            except BatchError as error:
                self.monitor.note(f"{process}: {error}")
                continue
            for entry in entries:
                if not self._is_repeated(entry):
                    self.monitor.take(entry, now_ns)
                    self.faults.take(entry)
                    watch = self._watchers.get(entry.noun)
                    if watch is not None:
                        watch(entry)

    def _see_recorder(self, entry: Recorded) -> None:
        """Note where the recording is: its folder may be moved."""
        try:
            path = Path(codec_of(RecorderStatus).decode(entry.data).path)
        except CodecError:
            return  # it reports twice a second
        moved = path.parent / self.recordings[0].name
        if moved not in self.recordings:
            self.recordings.append(moved)

    def _announce_recorder(self) -> None:
        """Let others know that no recorder runs, and why."""
        run, stop = self._announced, why_stopped(self.launcher.recorder)
        if run is not None and run.recorder_stop != stop:
            self._announced = replace(run, recorder_stop=stop)
            with suppress(GroundStationError):  # a folder that is gone ends no flight
                self._announced.announce()

    def _is_repeated(self, entry: Recorded) -> bool:
        """Whether it is a latched message that came before: publishers repeat them for late joiners."""
        noun, owner, sequence = entry[:3]
        if noun not in self._latching:
            return False
        is_repeated = self._latched.get((noun, owner)) == sequence
        self._latched[noun, owner] = sequence
        return is_repeated

    def _publish_latency(self) -> None:
        """Publish the ledger's summaries, on their own keys and in a record stream."""
        bus = self.launcher.bus
        if bus is None:
            return
        now_ns = time.monotonic_ns()
        self._sequence += 1
        batch = RecordWriter()
        for summary in self.monitor.summarise_latency(now_ns):
            envelope = Envelope(Latency.TOPIC, summary.vehicle, self._sequence, now_ns)
            batch.add(envelope, codec_of(Latency).encode(summary))
        bus.publish_batch(PROCESS, batch.take())
