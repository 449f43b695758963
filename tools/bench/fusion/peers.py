"""The published method, filterpy and gtsam on the same data: errors and times over ours."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from bench.fusion.data import SCENARIOS, WRONG_FIXES, folders_of
from bench.fusion.filterpy_peer import FilterpyPeer
from bench.fusion.gtsam_peer import GtsamPeer
from bench.fusion.pace import Pace, pace
from bench.fusion.score import Figures, flown, over_seeds
from bench.limits import plain, short
from bench.rows import Bench, Row
from groundstation.fusion.error_state_filter import ErrorStateFilter
from groundstation.fusion.estimator import EstimatorFactory
from groundstation.fusion.published_motion import joint

OURS = "ours"


@dataclass(frozen=True, slots=True)
class Method:
    """A way to fly the data.

    Attributes:
        factory: Of its estimator.
        is_cleaned: Whether the wrong fixes are taken out for it.
    """

    factory: EstimatorFactory
    is_cleaned: bool = False


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        OURS: Method(ErrorStateFilter),
        "published method": Method(joint),
        "published method, wrong fixes taken out for it": Method(joint, is_cleaned=True),
        "filterpy": Method(FilterpyPeer),
        "gtsam": Method(GtsamPeer),
    }
)
"""THE TABLE of methods, ours first."""
REPEATS = 2
FIELDS = ("position_mm", "velocity_mm_s", "heading_deg")


def measure(bench: Bench) -> list[Row]:
    """A row per method and scenario, and one for time."""
    sample = folders_of(bench, SCENARIOS[0])[0]
    methods: dict[str, Method] = {}
    paces: dict[str, Pace] = {}
    missing = []
    for name, method in METHODS.items():
        bench.say(f"fusion: pace of {name}")
        try:
            paces[name] = pace(sample, method.factory, REPEATS)
        except ImportError as error:
            missing.append(Row(f"beside: {name}", "", f"not available: {error}", None))
            continue
        methods[name] = method
    rows = []
    for scenario in (*SCENARIOS, WRONG_FIXES):
        folders = folders_of(bench, scenario)
        runs: dict[str, list[Figures]] = {name: [] for name in methods}
        for number, folder in enumerate(folders):
            for name, method in methods.items():
                bench.say(f"fusion: {name}, {scenario.name}, {number + 1} of {len(folders)}")
                runs[name].append(flown(folder, method.factory, is_cleaned=method.is_cleaned))
        rows += [_accuracy(name, scenario.name, runs) for name in methods]
    return [*rows, *(_time(name, found, paces[OURS]) for name, found in paces.items()), *missing]


def _accuracy(name: str, scenario: str, runs: Mapping[str, Sequence[Figures]]) -> Row:
    """Absolute figures, and as multiples of ours."""
    found = [over_seeds(runs[name], field) for field in FIELDS]
    used, wrong = (
        sum(counts) for counts in zip(*((run.wrong_used, run.wrong) for run in runs[name]), strict=True)
    )
    note = f"{used} of {wrong} wrong fixes used"
    if name != OURS:
        times = [x / over_seeds(runs[OURS], field) for x, field in zip(found, FIELDS, strict=True)]
        note = f"{' / '.join(map(short, times))} x ours; {note}"
    end_mm = over_seeds(runs[name], "outage_end_mm")
    if math.isfinite(end_mm):
        note += f"; outage ends at {short(end_mm)} mm"
    return plain(f"beside, {scenario}: {name}, mm / mm/s / deg RMS", found, note=note)


def _time(name: str, found: Pace, ours: Pace) -> Row:
    times = found.packet_s / ours.packet_s, found.fix_s / ours.fix_s
    note = f"{' / '.join(map(short, times))} x ours; small unit {1e3 * found.unit_s:.3f} ms"
    return plain(
        f"beside, CPU: {name}, us per sample / ms per late fix",
        (1e6 * found.packet_s, 1e3 * found.fix_s),
        note=note,
    )
