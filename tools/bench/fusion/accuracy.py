"""Accuracy of the filter and of the smoother over seeds, with what must be reached and what is aimed at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bench.fusion.data import SCENARIOS, WRONG_FIXES, Scenario, folders_of
from bench.fusion.score import Figures, flown, over_seeds, p99_mm
from bench.limits import at_most, between, plain
from bench.rows import Bench, Row
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import EstimatorFactory
from groundstation.fusion.offline import OfflineSmoother

Pair = tuple[float, float]
"""Must and aim."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What one scenario must reach, and what it aims at."""

    position_mm: Pair
    p99_mm: Pair
    velocity_mm_s: Pair
    heading_deg: Pair


LIMITS: Mapping[str, Limits] = MappingProxyType(
    {
        "station": Limits((1.6, 1.25), (3.8, 3.0), (0.75, 0.5), (0.027, 0.024)),
        "drift": Limits((1.8, 1.35), (4.3, 3.2), (0.9, 0.6), (0.027, 0.024)),
        "spin": Limits((1.8, 1.35), (4.3, 3.2), (0.9, 0.6), (0.037, 0.026)),
        "perimeter": Limits((2.1, 1.45), (5.2, 3.5), (1.3, 0.85), (0.027, 0.024)),
    }
)
OUTAGE_END_MM = (31.0, 12.0)
WRONG_FIXES_MM = (2.3, 1.6)
SMOOTHER_MM = dict.fromkeys(LIMITS, 0.52) | {"spin": 0.6, "outage": 0.6}
SMOOTHER_DEG = dict.fromkeys(LIMITS, 0.015) | {"spin": 0.025, "outage": 0.025}
SMOOTHER_MM_S = 0.33
SMOOTHER_AIM = (0.45, 0.2, 0.012)
INSIDE_LOW, INSIDE_HIGH = (60.0, 92.0, 99.0), (76.0, 98.0, 100.0)
"""Per cent of errors inside 1, 2, 3 reported sigmas."""
JUDGED_FLIGHTS = 12


def measure(bench: Bench) -> list[Row]:
    """Causal filter, wrong fixes, smoother; faults on, at least six seeds each."""
    rows, inside = [], []
    runs = {scenario.name: _runs(bench, scenario, "filter", ErrorStateFilter) for scenario in SCENARIOS}
    for name, figures in runs.items():
        rows += accuracy_rows(f"fusion, {name}", figures, LIMITS.get(name))
        inside += coverage_rows(f"fusion, {name}", figures)
    end_mm = over_seeds(runs["outage"], "outage_end_mm")
    worst = f"worst of {len(runs['outage'])} seeds {max(run.outage_end_mm for run in runs['outage']):.3g} mm"
    rows.append(
        at_most(
            "fusion: 10 s without stars, error at the end, RMS over seeds",
            end_mm,
            *OUTAGE_END_MM,
            "mm",
            worst,
        )
    )
    rows += wrong_fix_rows(_runs(bench, WRONG_FIXES, "filter", ErrorStateFilter))
    for scenario in SCENARIOS:
        rows.append(_smoother_row(scenario.name, _runs(bench, scenario, "smoother", OfflineSmoother)))
    every = [run for figures in runs.values() for run in figures]
    return [*rows, *coverage_rows("fusion, all scenarios", every), *inside]


def _runs(bench: Bench, scenario: Scenario, method: str, factory: EstimatorFactory) -> list[Figures]:
    figures = []
    folders = folders_of(bench, scenario)
    for number, folder in enumerate(folders):
        bench.say(f"fusion: {method}, {scenario.name}, {number + 1} of {len(folders)}")
        figures.append(flown(folder, factory))
    return figures


def accuracy_rows(what: str, figures: Sequence[Figures], limits: Limits | None) -> list[Row]:
    """Position, velocity and heading of one scenario."""
    position, p99 = over_seeds(figures, "position_mm"), p99_mm(figures)
    velocity, heading = over_seeds(figures, "velocity_mm_s"), over_seeds(figures, "heading_deg")
    names = [f"{what}: {name}" for name in ("position RMS", "position p99", "velocity RMS", "heading RMS")]
    seeds = f"{len(figures)} flights, worst {max(run.position_mm for run in figures):.3g}"
    if limits is None:
        return [
            plain(names[0], position, "mm", seeds),
            plain(names[1], p99, "mm"),
            plain(names[2], velocity, "mm/s"),
            plain(names[3], heading, "deg"),
        ]
    return [
        at_most(names[0], position, *limits.position_mm, "mm", seeds),
        at_most(names[1], p99, *limits.p99_mm, "mm"),
        at_most(names[2], velocity, *limits.velocity_mm_s, "mm/s"),
        at_most(names[3], heading, *limits.heading_deg, "deg"),
    ]


def coverage_rows(what: str, figures: Sequence[Figures]) -> list[Row]:
    """Whether the reported standard deviations are true; judged only over many flights.

    Errors of a flight hang together for tens of seconds, the heading's most of all, so that the share of a
    few flights beyond three sigmas is luck.
    """
    place = 100.0 * np.mean([run.inside_place for run in figures], axis=0)
    heading = 100.0 * np.mean([run.inside_heading for run in figures], axis=0)
    inside = "errors inside 1 / 2 / 3 reported sigma"
    names = f"{what}: x and y {inside}", f"{what}: heading {inside}"
    notes = f"NIS {np.mean([run.nis for run in figures]):.2f}", ""
    shares = place.tolist(), heading.tolist()
    if len(figures) < JUDGED_FLIGHTS:
        return [plain(name, share, "%", note) for name, share, note in zip(names, shares, notes, strict=True)]
    return [
        between(name, share, INSIDE_LOW, INSIDE_HIGH, unit="%", note=note)
        for name, share, note in zip(names, shares, notes, strict=True)
    ]


def wrong_fix_rows(
    figures: Sequence[Figures], what: str = "fusion, perimeter with 10 % wrong fixes"
) -> list[Row]:
    """Wrong fixes accepted, good ones refused, accuracy among them."""
    used, wrong = sum(run.wrong_used for run in figures), sum(run.wrong for run in figures)
    refused = sum(run.good_refused for run in figures)
    note = f"of {wrong}; {refused} good ones refused"
    position = over_seeds(figures, "position_mm")
    return [
        at_most(f"{what}: accepted", used, 0, 0, note=note),
        at_most(f"{what}: position RMS", position, *WRONG_FIXES_MM, "mm"),
    ]


def _smoother_row(name: str, figures: Sequence[Figures]) -> Row:
    found = [over_seeds(figures, field) for field in ("position_mm", "velocity_mm_s", "heading_deg")]
    must = (SMOOTHER_MM[name], SMOOTHER_MM_S, SMOOTHER_DEG[name])
    return at_most(f"smoother, {name}: mm / mm/s / deg RMS", found, must, SMOOTHER_AIM)
