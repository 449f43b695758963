"""The verdict on a run: limits against what was flown, and whether everybody ended as it should."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

from groundstation.parts.scenario.messages import ENDED
from groundstation.parts.scenario.player import STARTED_AGAIN
from groundstation.scenario.compiling import groups_of
from groundstation.scenario.flight_log import FlightLog
from groundstation.scenario.limits import expanded, nothing_flown
from groundstation.scenario.loading import Scenario
from groundstation.scenario.quantities import QUANTITIES, every_quantity
from groundstation.scenario.run_tracks import RunTracks, Span, Value
from groundstation.supervision.modes import Mode
from groundstation.watch.verdict import FAILED, PASSED, LimitOutcome, Verdict

UNEXPECTED = (Mode.LANDED, Mode.LANDING, Mode.STOPPED, Mode.LOST, Mode.RESTING)
"""Modes in which a vehicle has not ended as it should, unless it may land."""


@dataclass(frozen=True)
class Judged:
    """A run that has been judged.

    Attributes:
        verdict: With its limits.
        values: Every quantity over the whole run, by its column; empty where t = 0 never came.
        flown: What they were made from; None where t = 0 never came.
    """

    verdict: Verdict
    values: dict[str, Value]
    flown: RunTracks | None


def judge(scenario: Scenario, log: FlightLog, *, began_ns: int = 0) -> Judged:
    """Judge a run.

    Args:
        scenario: That was flown.
        log: Of the flight.
        began_ns: Stamp at which the recording began.
    """
    zero_ns = log.zero_ns
    if zero_ns is None:
        reason = log.status.reason if log.status is not None else ""
        limits = tuple(_not_reached(scenario))
        words = reason or "the run ended before t = 0, when the last vehicle flies"
        return Judged(_verdict(scenario, words, limits, log, 0.0), {}, None)
    seen = flown(scenario, log)
    outcomes = tuple(_outcomes(scenario, seen))
    reason = _went_wrong(scenario, log) or _first_broken(outcomes)
    verdict = _verdict(scenario, reason, outcomes, log, (zero_ns - began_ns) * 1e-9)
    return Judged(verdict, dict(every_quantity(seen)), seen)


def _verdict(
    scenario: Scenario, reason: str, limits: tuple[LimitOutcome, ...], log: FlightLog, zero_s: float
) -> Verdict:
    return Verdict(
        FAILED if reason else PASSED,
        reason,
        limits,
        log.events(),
        zero_s,
        scenario.name,
        tuple((each.x_m, each.y_m, each.radius_m) for each in scenario.rig.table.keep_out),
    )


def flown(scenario: Scenario, log: FlightLog) -> RunTracks:
    """What the quantities of a run are made from."""
    return replace(
        nothing_flown(scenario.file, scenario.rig),
        tracks=log.tracks(),
        events=log.events(),
        duration_s=min(scenario.file.duration_s, (log.last_ns - (log.zero_ns or 0)) * 1e-9),
    )


def _outcomes(scenario: Scenario, seen: RunTracks) -> Iterator[LimitOutcome]:
    groups = groups_of(scenario.rig)
    for number, limit in enumerate(scenario.file.limits):
        row = QUANTITIES[limit.what]
        span = Span(limit.from_s, scenario.file.duration_s if limit.to_s is None else limit.to_s)
        for vehicles in expanded(limit, number, groups):
            found = row.of(seen, vehicles, span)
            held = (limit.below is None or found.value < limit.below) and (
                limit.above is None or found.value > limit.above
            )
            yield LimitOutcome(
                limit.what,
                vehicles,
                found.value,
                limit.below,
                limit.above,
                held and not math.isnan(found.value),
                found.at_s,
            )


def _not_reached(scenario: Scenario) -> Iterator[LimitOutcome]:
    groups = groups_of(scenario.rig)
    for number, limit in enumerate(scenario.file.limits):
        for vehicles in expanded(limit, number, groups):
            yield LimitOutcome(limit.what, vehicles, math.nan, limit.below, limit.above, False, math.nan)


def _went_wrong(scenario: Scenario, log: FlightLog) -> str:
    """Why the run failed whatever its limits; empty if it did not."""
    if log.was_started_again:
        return STARTED_AGAIN
    if log.status is None or log.status.state != ENDED:
        reason = log.status.reason if log.status is not None else ""
        return reason or "the run ended before its scenario did"
    for name, rows in log.vehicles.items():
        keys = scenario.file.vehicles.get(name)
        may_land = name not in scenario.section.starters or (keys is not None and keys.may_land)
        if rows.mode in UNEXPECTED and not may_land:
            events = [event for event in log.events() if event.vehicle == name and event.kind == "mode"]
            at = f" since {events[-1].t_s:.1f} s ({events[-1].text.partition(': ')[2]})" if events else ""
            return f"{name} ended {rows.mode}{at}; give may_land = true where that is right"
    return ""


def _first_broken(outcomes: tuple[LimitOutcome, ...]) -> str:
    for outcome in outcomes:
        if not outcome.held:
            return sentence(outcome)
    return ""


def sentence(outcome: LimitOutcome) -> str:
    """A limit and what became of it, in words."""
    bounds = [
        f"{word} {bound:g}"
        for word, bound in (("below", outcome.below), ("above", outcome.above))
        if bound is not None
    ]
    found = "unknown: nothing was recorded to make it from"
    if math.isinf(outcome.value):
        found = "never reached"
    elif not math.isnan(outcome.value):
        found = f"{outcome.value:.4g} at {outcome.at_s:.1f} s"
    return f"{outcome.what} of {'-'.join(outcome.vehicles)} is {found}, limit {' and '.join(bounds)}"
