"""A whole lockstep run of a rig into a recording, in virtual time."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path

from groundstation.bus.envelope import Delivered, Envelope
from groundstation.declarations.errors import RigError, UsageError
from groundstation.declarations.rig import Rig
from groundstation.launch.recorder import in_a_sentence
from groundstation.launch.recorder_pause import SPARE_BYTES
from groundstation.parts.operation.messages import Latency
from groundstation.recording.errors import RecordingError
from groundstation.recording.writer import Recorder
from groundstation.rig.provenance import recording_info
from groundstation.runners.lockstep import LockstepRunner, Observer
from groundstation.runners.make_runner import make_runner, seed_of
from groundstation.runners.rare_collection import rare_collection
from groundstation.watch.fault_summary import FaultSummary
from groundstation.watch.ledger import Ledger

Progress = Callable[[str, float], None]
LATENCY_PERIOD_NS = 1_000_000_000
STEP_NS = 250_000_000


class _LatencyReporter:
    """Publishes the ledger's summaries once a second of virtual time."""

    def __init__(self, vehicles: tuple[str, ...], recorder: Recorder) -> None:
        self._vehicles = vehicles
        self._ledger = Ledger()
        self._recorder = recorder
        self._due_ns = LATENCY_PERIOD_NS
        self._sequence = 0

    def __call__(self, delivered: Delivered, now_ns: int) -> None:
        self._ledger.take_delivered(delivered)
        if now_ns < self._due_ns:
            return
        self._due_ns += LATENCY_PERIOD_NS
        self._sequence += 1
        for vehicle in self._vehicles:
            summary = self._ledger.summary(vehicle, now_ns)
            envelope = Envelope(Latency.TOPIC, vehicle, self._sequence, now_ns)
            self._recorder.record(Delivered(envelope, summary), now_ns)


def run_lockstep(
    rig: Rig,
    rig_text: str,
    rig_path: Path,
    recording: Path,
    duration_s: float,
    seed: int | None,
    progress: Progress,
    *,
    observers: Iterable[Observer] = (),
    is_over: Callable[[], bool] | None = None,
) -> FaultSummary:
    """Run a rig for ``duration_s`` of virtual time into a recording; return what went wrong.

    Args:
        rig: The rig.
        rig_text: Text of its file, as the recording keeps it.
        rig_path: The file.
        recording: Where to write.
        duration_s: At most so long.
        seed: Of the laboratory; None takes the rig's.
        progress: Called now and then.
        observers: See every message besides.
        is_over: Asked after each quarter of a second: True ends the run early.

    Raises:
        UsageError: The rig cannot run in lockstep, or the recording cannot be begun.
        GroundStationError: The recording cannot be written any further.
    """
    try:
        seed = seed_of(rig, seed)
    except RigError as error:
        raise RigError(f"{rig_path}: {error}") from error
    info = recording_info(rig, rig_text, rig_path, seed, utc_offset_ns=None)
    faults = FaultSummary(tuple(rig.vehicles), 0)
    try:
        recorder = Recorder(recording, info, spare_bytes=SPARE_BYTES)
    except RecordingError as error:
        raise UsageError(str(error)) from error
    try:
        reporter = _LatencyReporter(tuple(rig.vehicles), recorder)
        runner = make_runner(rig, seed, [recorder.record, reporter, faults.take_delivered, *observers])
    except BaseException as error:
        recorder.discard()
        if isinstance(error, RigError):
            raise RigError(f"{rig_path}: {error}") from error
        raise
    try:
        with in_a_sentence(recorder):
            try:
                run_until(runner, round(duration_s * 1e9), progress, is_over)
            finally:
                runner.close()
            recorder.finish()
    except BaseException:
        _end(recorder)
        raise
    return faults


def run_until(
    runner: LockstepRunner, until_ns: int, progress: Progress, is_over: Callable[[], bool] | None
) -> None:
    """Run to a moment of virtual time; in steps, where it may be over before."""
    seconds = until_ns * 1e-9

    def report(now_ns: int) -> None:
        progress(f"{now_ns * 1e-9:.1f} s of {seconds:g} s", now_ns * 1e-9)

    with rare_collection():
        if is_over is None:
            runner.run(until_ns, report)
            return
        while runner.now_ns < until_ns and not is_over():
            runner.run(min(STEP_NS, until_ns - runner.now_ns))
            report(runner.now_ns)


def _end(recorder: Recorder) -> None:
    """Finish what was recorded until something failed; if the disk is what failed, what it has taken."""
    try:
        recorder.finish()
    except RecordingError:
        with suppress(RecordingError):  # then what is there can be recovered
            recorder.end_early()
