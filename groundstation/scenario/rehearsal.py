"""Before anything moves: failures are tried on an empty laboratory, hardware's flights on its twin.

The dry run flies once as the file has it and three times with its dispersions. It is refused where a mock-up
touches the edge, another one or an obstacle, where a limit fails, or where a wait times out.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import replace

from drivers.laboratory import LABORATORY_CHANNEL, FailureRefused, InjectOrder, Laboratory
from groundstation.declarations.errors import RigError, UsageError
from groundstation.declarations.rig import Rig
from groundstation.parts.laboratory.failure_desk import INJECT
from groundstation.parts.scenario.sections import ScenarioOfRig
from groundstation.rig.provenance import file_hashes
from groundstation.rig.read import load_rig, source_of
from groundstation.runners.make_runner import open_laboratory
from groundstation.scenario.dispersions import draw, extremes, laboratory_seed
from groundstation.scenario.judging import Judged
from groundstation.scenario.loading import Scenario
from groundstation.scenario.quantities import QUANTITIES
from groundstation.scenario.run_tracks import RunTracks, Span, Value
from groundstation.scenario.running import Progress, fly, seed_for, silent
from groundstation.scenario.scenario_file import ScenarioError

DISPERSED = 3
"""Dry runs with dispersions, besides the one without."""


def check_failures(scenario: Scenario) -> None:
    """Try every failure of the timeline on a laboratory that nobody flies in.

    Raises:
        ScenarioError: The laboratory refuses one, or what the scenario changes.
    """
    laboratory = _opened(scenario)
    try:
        for moment, row in enumerate(scenario.section.timeline, 1):
            if row.action != INJECT.name:
                continue
            given = json.loads(row.arguments)
            for vehicle in row.vehicles:
                order = InjectOrder(
                    given["failure"], vehicle, json.loads(given["parameters"]), float(given["for_s"])
                )
                if LABORATORY_CHANNEL not in laboratory.channels():
                    raise ScenarioError(f"{scenario.path}: {row.where}: this laboratory injects no failures")
                laboratory.deliver(moment, LABORATORY_CHANNEL, order)
                for arrival in laboratory.advance(moment):
                    if isinstance(arrival.data, FailureRefused):
                        raise ScenarioError(f"{scenario.path}: {row.where}: {arrival.data.reason}")
    finally:
        laboratory.close()


def _opened(scenario: Scenario) -> Laboratory:
    """The laboratory of a scenario; a mistake of its rig is the rig's."""
    try:
        return open_laboratory(scenario.rig, 0)
    except RigError as error:
        try:
            open_laboratory(scenario.base, 0).close()
        except RigError as its:
            raise ScenarioError(f"{source_of(scenario.base).path}: {its}") from its
        raise ScenarioError(f"{scenario.path}: {_spelled(scenario, str(error))}") from error


def _spelled(scenario: Scenario, reason: str) -> str:
    """A sentence of the laboratory with the key as the scenario spells it."""
    for name, keys in scenario.file.vehicles.items():
        for key in keys.laboratory:
            reason = reason.replace(f"laboratory.vehicles.{name}.{key}", f"vehicles.{name}.laboratory.{key}")
    return reason.replace("laboratory.vehicles.", "laboratory.")


def check_dispersions(scenario: Scenario) -> None:
    """Draw once, and see whether rig and laboratory take it.

    Raises:
        ScenarioError: They do not; the sentence names the key.
    """
    drawn = draw(scenario, 0, 0)
    if not drawn:
        return
    try:
        check_failures(scenario.vary(drawn))
    except UsageError as together:
        for key, value in drawn.items():
            try:
                check_failures(scenario.vary({key: value}))
            except UsageError as error:
                raise _refused(scenario, f"dispersions.{key}", error) from error
        raise _refused(scenario, "dispersions", together) from together


def check_extremes(scenario: Scenario) -> None:
    """Try every choice and both ends of what is uniform, one key at a time.

    Raises:
        ScenarioError: Rig or laboratory refuse one; the sentence names key and value.
    """
    for pattern, changes in extremes(scenario):
        try:
            check_failures(scenario.vary(changes))
        except UsageError as error:
            value = next(iter(changes.values()))
            raise _refused(scenario, f"dispersions.{pattern}: {value!r}", error) from error


def check_varied(scenario: Scenario, changes: Mapping[str, object], what: str) -> None:
    """Try what somebody changes besides the file.

    Args:
        scenario: As its file has it.
        changes: By key.
        what: What they come from, for the sentence.

    Raises:
        ScenarioError: Rig or laboratory refuse it.
    """
    try:
        check_failures(scenario.vary(changes))
    except UsageError as error:
        raise _refused(scenario, what, error) from error


def _refused(scenario: Scenario, what: str, error: UsageError) -> ScenarioError:
    reason = str(error).removeprefix(f"{scenario.path}: ").removeprefix("changes.")
    reason = reason.removeprefix(f"{what.removeprefix('dispersions.')}: ")
    return ScenarioError(f"{scenario.path}: {what}: {reason}")


def twin_of(rig: Rig) -> Rig:
    """The emulated twin that a hardware rig names.

    Raises:
        RigError: It names none, or one that is no twin: without a laboratory, with other vehicles, with
            another table or other calibration files.
    """
    named = rig.section(ScenarioOfRig).twin
    if named is None:
        raise RigError(
            "the rig names no emulated twin for the dry run: give 'twin', a rig file with a [laboratory]"
        )
    twin = load_rig(named.path)
    if twin.laboratory is None:
        raise RigError(f"twin: {named.path} has no [laboratory]")
    if set(twin.vehicles) != set(rig.vehicles):
        raise RigError(f"twin: {named.path} has other vehicles: {', '.join(twin.vehicles)}")
    if twin.table != rig.table:
        raise RigError(f"twin: [table] of {named.path} is not that of the rig: its edges would be elsewhere")
    theirs = file_hashes(twin)
    for key, sha256 in file_hashes(rig).items():
        if key != "twin" and theirs.get(key, sha256) != sha256:
            raise RigError(f"twin: {key} of {named.path} is not the file that the rig names")
    return twin


def rehearse(scenario: Scenario, hardware: Rig, seed: int | None = None, progress: Progress = silent) -> str:
    """Fly on the twin what is to fly on hardware.

    Args:
        scenario: As its file has it.
        hardware: The rig that it is to fly on.
        seed: Of the dry runs; None takes the scenario's.
        progress: Called now and then.

    Returns:
        Why it is refused, with time, place and reason; empty where it is not.

    Raises:
        UsageError: There is no twin, or the scenario does not fit it.
    """
    twin = replace(scenario, base=twin_of(hardware)).vary({})
    chosen = seed_for(twin, seed)
    judged = fly(twin, chosen, progress)
    refusal = _refusal(judged, "the dry run")
    for run in range(DISPERSED):
        if refusal:
            break
        drawn = draw(twin, chosen, run)
        judged = fly(twin.vary(drawn), laboratory_seed(chosen, run), progress)
        refusal = _refusal(judged, f"dry run {run + 1} with dispersions")
    return refusal


def _refusal(judged: Judged, what: str) -> str:
    touched = _contact(judged.flown) if judged.flown is not None else ""
    if touched:
        return f"{what}: {touched}"
    return f"{what}: {judged.verdict.reason}" if judged.verdict.reason else ""


def _contact(flown: RunTracks) -> str:
    """Who touched something first, when and where; empty if nobody did."""
    whole = Span(0.0, flown.duration_s)
    found: list[tuple[str, Value]] = []
    for vehicle in flown.tracks:
        value = QUANTITIES["contacts"].of(flown, (vehicle,), whole)
        if value.value > 0.0:
            found.append((vehicle, value))
    if not found:
        return ""
    vehicle, value = min(found, key=lambda each: each[1].at_s)
    truth = flown.tracks[vehicle].truth
    place = truth[int(abs(truth[:, 0] - value.at_s).argmin()), 1:3]
    x, y = (float(each) if math.isfinite(each) else math.nan for each in place)
    return f"{vehicle} touches something at {value.at_s:.1f} s, at ({x:.2f}, {y:.2f}) m"
