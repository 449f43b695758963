"""How the limits of a scenario stand while it flies: open, held, or broken for good."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from groundstation.scenario.compiling import groups_of
from groundstation.scenario.flight_log import FlightLog
from groundstation.scenario.judging import flown, sentence
from groundstation.scenario.limits import expanded
from groundstation.scenario.loading import Scenario
from groundstation.scenario.quantities import QUANTITIES
from groundstation.scenario.run_tracks import Span
from groundstation.watch.verdict import LimitOutcome

ONLY_GROW = frozenset(
    {
        "position_error_max_mm", "estimate_error_max_mm", "gas_ns", "contacts", "contact_speed_mm_s",
        "overshoot_mm", "faults",
    }
)  # fmt: skip
"""Quantities that cannot become smaller: above their limit they stay broken."""
ONLY_SHRINK = frozenset({"least_edge_mm", "least_distance_mm", "least_obstacle_mm"})
"""Quantities that cannot become larger."""


@dataclass(frozen=True, slots=True)
class Standing:
    """One limit of one vehicle or pair.

    Attributes:
        text: The limit and its value so far, for people.
        held: Whether it was held; None while that is open.
    """

    text: str
    held: bool | None


def standings(scenario: Scenario, log: FlightLog) -> Iterator[Standing]:
    """Every limit as it stands at the log's newest message; nothing before t = 0."""
    if log.zero_ns is None:
        return
    seen, groups = flown(scenario, log), groups_of(scenario.rig)
    now_s = (log.last_ns - log.zero_ns) * 1e-9
    for number, limit in enumerate(scenario.file.limits):
        until_s = scenario.file.duration_s if limit.to_s is None else limit.to_s
        for vehicles in expanded(limit, number, groups):
            if now_s <= limit.from_s:
                yield Standing(f"{' and '.join(vehicles)}: {limit.what} from {limit.from_s:g} s on", None)
                continue
            found = QUANTITIES[limit.what].of(seen, vehicles, Span(limit.from_s, min(until_s, now_s)))
            is_held = (limit.below is None or found.value < limit.below) and (
                limit.above is None or found.value > limit.above
            )
            outcome = LimitOutcome(
                limit.what, vehicles, found.value, limit.below, limit.above, is_held, found.at_s
            )
            is_final = now_s >= until_s or (
                not is_held
                and not math.isnan(found.value)
                and (
                    (limit.what in ONLY_GROW and limit.below is not None and found.value >= limit.below)
                    or (limit.what in ONLY_SHRINK and limit.above is not None and found.value <= limit.above)
                )
            )
            held = is_held and not math.isnan(found.value)
            yield Standing(sentence(outcome), held if is_final else None)
