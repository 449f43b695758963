"""A whole lockstep run of a rig: laboratory, nodes, recorder and ledger, in virtual time."""

from collections.abc import Callable
from pathlib import Path

from pydantic import ValidationError

from drivers.errors import NotFound
from drivers.laboratory import load_laboratory
from groundstation.bus.envelope import Delivered, Envelope
from groundstation.bus.journal import JournalWriter, NoJournal
from groundstation.bus.topics import topic_of
from groundstation.messages.definitions import Latency
from groundstation.recording.errors import RecordingError
from groundstation.recording.writer import Recorder
from groundstation.runtime.errors import RigError, UsageError
from groundstation.runtime.ledger import HEARD, Ledger
from groundstation.runtime.lockstep import LockstepRunner, Observer
from groundstation.runtime.node_table import build_slots
from groundstation.runtime.plan import laboratory_ports
from groundstation.runtime.provenance import recording_info
from groundstation.runtime.rig import Rig
from groundstation.runtime.slot import Sequences

Progress = Callable[[str, float], None]
LATENCY_PERIOD_NS = 1_000_000_000
DEFAULT_SEED = 1


def make_runner(rig: Rig, seed: int, observers: list[Observer], *, journaled: bool = True) -> LockstepRunner:
    """Build everything that a rig names, on one thread and in virtual time.

    Raises:
        RigError: The rig has no laboratory, or its laboratory refuses its table.
    """
    if rig.laboratory is None:
        raise RigError("lockstep needs a [laboratory]: real hardware runs in real time")
    journal, sequences = JournalWriter() if journaled else NoJournal(), Sequences()
    try:
        laboratory = load_laboratory(rig.laboratory.name, rig.laboratory.table, seed)
        slots = build_slots(rig, None, journal, sequences, measure=False)
    except ValidationError as error:
        raise RigError(_sentence(error)) from error
    except (NotFound, ValueError) as error:  # a file of the laboratory, or of our calibration
        raise RigError(str(error)) from error
    ports = laboratory_ports(rig, laboratory.channels())
    return LockstepRunner(slots, laboratory, ports, observers, journal, sequences)


def _sentence(error: ValidationError) -> str:
    first = error.errors()[0]
    key = ".".join(str(part) for part in ("laboratory", *first["loc"]))
    return f"{key}: {first['msg'].removeprefix('Value error, ')}"


def seed_of(rig: Rig, seed: int | None) -> int:
    """The seed asked for, else the rig's, else ``DEFAULT_SEED``."""
    if seed is not None:
        return seed
    table = rig.laboratory.table if rig.laboratory is not None else {}
    return int(table.get("seed", DEFAULT_SEED))


class _LatencyReporter:
    """Says the ledger's summaries once a second of virtual time."""

    def __init__(self, vehicles: tuple[str, ...], recorder: Recorder) -> None:
        self._vehicles = vehicles
        self._ledger = Ledger()
        self._recorder = recorder
        self._due_ns = LATENCY_PERIOD_NS
        self._sequence = 0

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        if type(delivered.payload) in HEARD:
            self._ledger.take(delivered)
        if now_ns < self._due_ns:
            return
        self._due_ns += LATENCY_PERIOD_NS
        self._sequence += 1
        topic = topic_of(Latency)
        for vehicle in self._vehicles:
            summary = self._ledger.summary(vehicle, now_ns)
            envelope = Envelope(topic, vehicle, self._sequence, now_ns)
            self._recorder.record(Delivered(envelope, summary), now_ns)


def run_lockstep(
    rig: Rig, rig_path: Path, recording: Path, duration_s: float, seed: int | None, progress: Progress
) -> None:
    """Run a rig for ``duration_s`` of virtual time into a recording.

    Raises:
        UsageError: The rig cannot run in lockstep, or the recording cannot be written.
    """
    seed = seed_of(rig, seed)
    info = recording_info(rig, rig_path, seed, utc_offset_ns=None)
    try:
        recorder = Recorder(recording, info)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    try:
        runner = make_runner(rig, seed, [recorder.record, _LatencyReporter(tuple(rig.vehicles), recorder)])
    except BaseException:
        recorder.discard()
        raise
    with recorder:
        try:
            runner.run(
                round(duration_s * 1e9),
                lambda now_ns: progress(f"{now_ns * 1e-9:.1f} s of {duration_s:g} s", now_ns * 1e-9),
            )
        finally:
            runner.close()
