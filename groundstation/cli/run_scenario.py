"""A scenario as ``groundstation run`` flies it: live, in lockstep, on hardware; then the verdict."""

import sys
from dataclasses import dataclass
from pathlib import Path

from groundstation.bus.cdr import CodecError, codec_of
from groundstation.bus.record_stream import Recorded
from groundstation.cli.live_view import run_live
from groundstation.cli.run_files import finish_folder, finished_files, kept_in
from groundstation.cli.run_progress import RunProgress
from groundstation.declarations.errors import GroundStationError, NodeError, RigError, UsageError
from groundstation.files.writing import check_folder
from groundstation.launch.attendant import Attendant
from groundstation.launch.live_run import LiveRun
from groundstation.parts.scenario.messages import FAILED, RUNNING, WAITING, Marker, ScenarioStatus
from groundstation.recording.disk_file import check_new_recording
from groundstation.recording.errors import RecordingError
from groundstation.rig.read import load_rig, source_of
from groundstation.scenario.judging import Judged, sentence
from groundstation.scenario.loading import Scenario, rig_text
from groundstation.scenario.rehearsal import check_dispersions, check_failures, rehearse, twin_of
from groundstation.scenario.running import fly_recorded, judge_recordings, longest_s, seed_for
from groundstation.watch.verdict import PASSED

HELD, BROKEN, WRONG = 0, 1, 3
"""Exit codes: all limits held; one failed, or a vehicle ended otherwise than it should; error."""


@dataclass(frozen=True)
class Asked:
    """What the command line asks for."""

    lockstep: bool
    headless: bool
    seed: int | None
    record: Path | None
    report: Path | None
    compare: Path | None
    hardware: Path | None
    i_know: str | None
    text: str
    """Of the scenario's file."""
    attendants: tuple[Attendant, ...] = ()
    by_hand: bool = False


def run_scenario(scenario: Scenario, asked: Asked) -> int:
    """Fly a scenario; return the exit code.

    Raises:
        UsageError: The file, or what was asked for, is wrong.
    """
    if asked.lockstep and asked.hardware is not None:
        raise UsageError("--hardware runs in real time, --lockstep in virtual time: give one of them")
    if asked.i_know is not None and asked.hardware is None:
        raise UsageError("--i-know goes with --hardware: only there a dry run can refuse")
    if asked.i_know is not None and not (asked.i_know.strip() and asked.i_know.isprintable()):
        raise UsageError("--i-know needs a reason in words, on one line: it is recorded")
    if asked.by_hand and asked.lockstep:
        raise UsageError("--by-hand goes with real time: in virtual time nobody can start it")
    if asked.record is not None:
        check_new_recording(asked.record)
    if asked.report is not None:
        check_folder(asked.report)
    seed = seed_for(scenario, asked.seed)
    if asked.hardware is not None:
        scenario = _on_hardware(scenario, asked, asked.hardware)
    else:
        check_failures(scenario)
        check_dispersions(scenario)
    try:
        judged = _flown(scenario, asked, seed)
    except UsageError:
        raise
    except KeyboardInterrupt:
        sys.stderr.write("groundstation: ended by hand, so there is no verdict\n")
        return WRONG
    except (GroundStationError, NodeError, RecordingError) as error:
        sys.stderr.write(f"groundstation: {error}\n")
        return WRONG
    _print_verdict(judged)
    return HELD if judged.verdict.verdict == PASSED else BROKEN


def _on_hardware(scenario: Scenario, asked: Asked, path: Path) -> Scenario:
    """The scenario on the hardware, once its twin has flown it."""
    hardware = load_rig(path)
    try:
        twin_of(hardware)
    except RigError as error:
        raise UsageError(f"{path}: {error}") from error
    on_hardware = scenario.on_hardware(hardware)
    with RunProgress(longest_s(scenario)) as progress:
        refusal = rehearse(scenario, hardware, asked.seed, progress)
    if not refusal:
        print("dry run on the twin: passed")
        return on_hardware
    if asked.i_know is None:
        raise UsageError(f"{refusal}; --i-know REASON flies all the same, and is recorded")
    print(f"dry run on the twin: {refusal}; flown all the same: {asked.i_know}")
    return on_hardware.remarked(f"flown although {refusal}: {asked.i_know}")


def _flown(scenario: Scenario, asked: Asked, seed: int) -> Judged:
    trouble = ""
    if not asked.lockstep and scenario.rig.laboratory is not None:
        scenario = scenario.vary({"laboratory.seed": seed})
    if asked.by_hand:
        scenario = scenario.started_by_hand()
    kept = kept_in(asked.record, scenario.rig, rig_text(scenario.rig), scenario.name, asked.text)
    with kept as (recording, folder):
        firsts = [recording]
        try:
            if asked.lockstep:
                with RunProgress(longest_s(scenario)) as progress:
                    judged, faults = fly_recorded(scenario, seed, recording, progress)
            else:
                judged, faults = None, None
                trouble, firsts = _fly_live(scenario, asked, recording)
        finally:
            finished, _ = finished_files(*firsts)
        if judged is None:
            judged = judge_recordings(scenario, finished)
        for line in faults.lines() if faults is not None else ():
            print(line)
        folder = finish_folder(folder, finished, judged.verdict)
    if trouble:
        raise GroundStationError(trouble)
    if asked.report is not None and finished:
        from groundstation.cli.report import print_report  # matplotlib: half a second that a start has not

        recorded = finished[-1] if folder is None else folder.path
        print_report(recorded, asked.report, verdict=judged.verdict, compare=asked.compare)
    return judged


class _Watch:
    """Follows how far a live scenario has come."""

    def __init__(self) -> None:
        self.live: LiveRun | None = None
        self.is_over = False
        self._last = ("", 0)

    def status(self, recorded: Recorded) -> None:
        """Take a status of the player."""
        try:
            status = codec_of(ScenarioStatus).decode(recorded.data)
        except CodecError:
            return  # garbled: the next one comes in a fifth of a second
        was_begun = self._last[0] not in ("", WAITING)
        self.is_over = status.state not in (WAITING, RUNNING) or (was_begun and status.state == WAITING)
        now = status.state, status.fired
        if now != self._last:
            self._last = now
            waits = f", waits for {status.waits_for}" if status.waits_for else ""
            reason = f": {status.reason}" if status.state == FAILED else ""
            self._note(f"scenario {status.state}, {status.fired} rows done{waits}{reason}")

    def marker(self, recorded: Recorded) -> None:
        """Take a marker."""
        try:
            self._note(f"marker: {codec_of(Marker).decode(recorded.data).text}")
        except CodecError:
            return  # it stands in the recording

    def _note(self, text: str) -> None:
        if self.live is not None:
            self.live.monitor.note(text)


def _fly_live(scenario: Scenario, asked: Asked, recording: Path) -> tuple[str, list[Path]]:
    """Fly in real time; what is wrong with the recording, empty if nothing is, and where its files are."""
    watch = _Watch()
    watch.live = LiveRun(
        scenario.rig,
        rig_text(scenario.rig),
        source_of(scenario.rig).path,
        recording,
        {ScenarioStatus.TOPIC.noun: watch.status, Marker.TOPIC.noun: watch.marker},
        attendants=asked.attendants,
    )
    headless = asked.headless or not sys.stdout.isatty()
    run_live(watch.live, None, headless=headless, is_over=lambda: watch.is_over)
    for line in (*watch.live.recorder_lines, *watch.live.faults.lines()):
        print(line)
    return watch.live.recording_trouble, watch.live.recordings


def _print_verdict(judged: Judged) -> None:
    for outcome in judged.verdict.limits:
        print(f"{'held  ' if outcome.held else 'FAILED'} {sentence(outcome)}")
    reason = judged.verdict.reason
    print(f"verdict: {judged.verdict.verdict}{f': {reason}' if reason else ''}")
