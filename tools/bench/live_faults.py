"""Every failure live, two seeds each, and a healthy flight while other processes load every core.

The flights of `tools/fault_campaign.py` with real processes, ports and time: the failure is injected by a
request, and the recording is judged.
"""

import json
import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fault_campaign import (
    AFTER_S,
    HEALTHY,
    LEG_S,
    PUSH_S,
    PUSHED,
    Judge,
    Outcome,
    drawn,
    failures,
    goal_of,
    valve_of,
)

from bench.flying import flying, load
from bench.rows import Bench, Row
from groundstation.launch.asking import ask_each
from groundstation.parts.laboratory.messages import InjectedFailure
from groundstation.recording.reader import Recording

SEEDS = 2
HEALTHY_S = 900.0
SETTLES_S = 3.0
EXCEPTED = {"cpu_starved"}
"""Of a machine that is loaded on purpose."""
AUTHOR = "bench"
FOREVER_S = 3600.0
PROMISES = ("left_table", "hit_neighbour", "floated_unarmed", "open_when_disarmed")


@dataclass(frozen=True)
class _Flight:
    """One flight that is to be flown live.

    Attributes:
        failure: What is injected.
        seed: Of what is drawn.
        after_s: How long it goes on after that.
    """

    failure: str
    seed: int
    after_s: float


def measure(bench: Bench) -> list[Row]:
    """A row per promise, one of what was not found, one of false alarms."""
    flights = [
        _Flight(name, seed, AFTER_S if "valve" in name else AFTER_S / 2.0)  # a valve has to be used first
        for name in failures()
        for seed in range(1, SEEDS + 1)
    ]
    seen = []
    for number, flight in enumerate(flights, 1):
        bench.say(f"live faults: {flight.failure}, seed {flight.seed}: {number} of {len(flights)}")
        seen.append(_fly(bench, flight))
    rows = [_promise(promise, seen) for promise in PROMISES]
    missed = [f"{row.failure} {row.seed}" for row in seen if not row.fault]
    rows.append(
        Row(
            "failures found, live",
            "all",
            f"{len(seen) - len(missed)} of {len(seen)}; not: {missed}",
            not missed,
        )
    )
    before = {alarm for row in seen for alarm in row.false_alarms}
    rows.append(Row("false alarms before the failure, live", "0", f"{sorted(before) or 0}", not before))
    with load(os.cpu_count() or 1):
        bench.say("live faults: healthy, every core loaded")
        healthy = _fly(bench, _Flight(HEALTHY, 1, HEALTHY_S))
    alarms = sorted({*healthy.false_alarms, *healthy.others} - EXCEPTED)
    what = f"false alarms in {HEALTHY_S / 60.0:.0f} min live, another process on each core"
    rows.append(Row(what, "0", f"{alarms or 0}, at the end {healthy.mode}", not alarms))
    return rows


def _promise(promise: str, seen: list[Outcome]) -> Row:
    broken = [f"{row.failure} {row.seed}" for row in seen if getattr(row, promise)]
    told = f"{len(broken)}" + (f": {', '.join(broken)}" if broken else "")
    return Row(f"{len(seen)} live flights with a failure: {promise.replace('_', ' ')}", "0", told, not broken)


def _fly(bench: Bench, flight: _Flight) -> Outcome:
    rng, text, given = drawn(flight.failure, flight.seed)
    start_s = given.pop("start_s")
    rig = bench.folder / "live_faults.toml"
    rig.write_text(text, encoding="utf-8")
    path = bench.folder / f"{flight.failure}_{flight.seed}.mcap"
    with flying(bench, rig, "--record", str(path)) as run:
        run.wait_for(r"(\w+): flying", {"alpha"})
        endpoint = run.rig.endpoint
        _laps(endpoint, rng, SETTLES_S + start_s % LEG_S)
        begin_ns = time.monotonic_ns()
        if flight.failure != HEALTHY:
            for_s = PUSH_S if flight.failure == PUSHED else FOREVER_S
            words = {"failure": flight.failure, "for_s": for_s, "parameters": json.dumps(given)}
            ask_each(endpoint, ("alpha",), "inject", words, AUTHOR, 5.0)
        _laps(endpoint, rng, flight.after_s)
    return _judged(path, flight, begin_ns, given)


def _laps(endpoint: str, rng: np.random.Generator, for_s: float) -> None:
    """To and fro, a leg begun whenever the one before should be over."""
    until_s, number = time.monotonic() + for_s, 0
    while (left_s := until_s - time.monotonic()) > 0.0:
        ask_each(endpoint, ("alpha",), "go_to", goal_of(number, rng), AUTHOR, 1.0)
        time.sleep(max(0.0, min(LEG_S, until_s - time.monotonic(), left_s)))
        number += 1


def _judged(path: Path, flight: _Flight, begin_ns: int, given: dict[str, float]) -> Outcome:
    with Recording(path) as recording:
        for delivered in recording.delivered([InjectedFailure], ["alpha"]):
            if isinstance(delivered.payload, InjectedFailure) and delivered.payload.is_active:
                begin_ns = delivered.payload.stamp_ns
        judge = Judge(flight.failure, begin_ns * 1e-9, valve_of(given))
        for delivered in recording.delivered(Judge.KINDS):
            judge(delivered, delivered.envelope.publish_ns)
    path.unlink()
    return judge.outcome(flight.seed)
