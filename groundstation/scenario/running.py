"""A scenario flown: in virtual time here; live runs are judged by their recordings."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from groundstation.control.controller import Controller
from groundstation.declarations.errors import RigError
from groundstation.launch.lockstep_run import run_lockstep, run_until
from groundstation.parts.control.part import controller_node
from groundstation.parts.scenario.messages import RUNNING, WAITING
from groundstation.recording.errors import RecordingError
from groundstation.recording.reader import Recording
from groundstation.rig.read import source_of
from groundstation.runners.make_runner import make_runner, seed_of
from groundstation.scenario.flight_log import LOGGED, FlightLog
from groundstation.scenario.judging import Judged, judge
from groundstation.scenario.loading import Scenario, rig_text
from groundstation.scenario.scenario_file import ScenarioError
from groundstation.watch.fault_summary import FaultSummary

Progress = Callable[[str, float], None]
MARGIN_S = 1.0
"""After the longest that a scenario can take: its end is reported then."""


def silent(text: str, done: float) -> None:
    """Report no progress."""
    del text, done


def longest_s(scenario: Scenario) -> float:
    """The longest that a run takes, from its start."""
    return scenario.file.ready_s + scenario.file.duration_s + MARGIN_S


def seed_for(scenario: Scenario, seed: int | None) -> int:
    """The seed asked for, else the scenario's, else its rig's.

    Raises:
        ScenarioError: The rig's is no seed.
    """
    if seed is None:
        seed = scenario.file.seed
    try:
        return seed_of(scenario.rig, seed)
    except RigError as error:
        raise ScenarioError(f"{scenario.path}: {error}") from error


def fly(
    scenario: Scenario,
    seed: int,
    progress: Progress = silent,
    laws: Mapping[str, Controller] = MappingProxyType({}),
) -> Judged:
    """Fly in virtual time and record nothing: campaigns, notebooks, dry runs.

    Args:
        scenario: What to fly.
        seed: Of the laboratory.
        progress: Called now and then.
        laws: Controllers in the place of the scenario's, by vehicle.

    Raises:
        ScenarioError: The laboratory refuses what the scenario changes.
        NodeError: A node raised something.
    """
    log = FlightLog(tuple(scenario.rig.vehicles))
    replaced = {f"{name}/controller": controller_node(scenario.rig, name, law) for name, law in laws.items()}
    try:
        runner = make_runner(scenario.rig, seed, [log.observe], journaled=False, replaced=replaced)
    except RigError as error:
        raise ScenarioError(f"{scenario.path}: {error}") from error
    try:
        run_until(runner, round(longest_s(scenario) * 1e9), progress, lambda: is_over(log))
    finally:
        runner.close()
    return judge(scenario, log)


def fly_recorded(
    scenario: Scenario, seed: int, recording: Path, progress: Progress = silent
) -> tuple[Judged, FaultSummary]:
    """Fly in virtual time into a recording.

    Raises:
        UsageError: The laboratory refuses what the scenario changes, or the recording cannot be begun.
        GroundStationError: It cannot be written any further.
    """
    log = FlightLog(tuple(scenario.rig.vehicles))
    faults = run_lockstep(
        scenario.rig,
        rig_text(scenario.rig),
        source_of(scenario.rig).path,
        recording,
        longest_s(scenario),
        seed,
        progress,
        observers=[log.observe],
        is_over=lambda: is_over(log),
    )
    return judge(scenario, log), faults


def is_over(log: FlightLog) -> bool:
    """Whether the player has reported that its scenario has ended or failed."""
    return log.status is not None and log.status.state not in (WAITING, RUNNING)


def judge_recordings(scenario: Scenario, recordings: Iterable[Path]) -> Judged:
    """Judge a live run by what was recorded of it, in the order of the files.

    Raises:
        RecordingError: One of them cannot be read.
    """
    log = FlightLog(tuple(scenario.rig.vehicles))
    began_ns: int | None = None
    for path in recordings:
        with Recording(path) as recording:
            began_ns = recording.start_ns if began_ns is None else began_ns
            for delivered in recording.delivered(LOGGED):
                log.take(delivered.payload, delivered.envelope.publish_ns)
    if began_ns is None:
        raise RecordingError("no recording was finished, so there is nothing to judge")
    return judge(scenario, log, began_ns=began_ns)
