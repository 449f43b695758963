"""THE TABLE of quantities: what limits can be set on, and what a campaign has columns for. Pure.

By truth where there is a reference system, by the estimate otherwise. Each gives a value and the moment at
which it was reached; NaN where there is nothing to make it from, infinite where what it counts never came.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from groundstation.scenario import clearances, deviations, first_contact
from groundstation.scenario.flight_log import within
from groundstation.scenario.run_tracks import RunTracks, Span, Value


@dataclass(frozen=True, slots=True)
class Quantity:
    """A row of the table.

    Attributes:
        summary: For people.
        of: Computes it for the vehicles over a span.
        is_of_pair: Of two vehicles; otherwise of one.
        applies: Whether a vehicle has it at all: only then it is a column of a campaign.
        least: No value is below.
    """

    summary: str
    of: Callable[[RunTracks, tuple[str, ...], Span], Value]
    is_of_pair: bool = False
    applies: Callable[[RunTracks, str], bool] = lambda flown, vehicle: True
    least: float = 0.0


def _follows(flown: RunTracks, vehicle: str) -> bool:
    return vehicle in flown.keeps


def _has_obstacles(flown: RunTracks, vehicle: str) -> bool:
    del vehicle
    return bool(flown.obstacles)


def _docks(flown: RunTracks, vehicle: str) -> bool:
    return vehicle in flown.docks


def _faces(flown: RunTracks, vehicle: str) -> bool:
    return vehicle in flown.keeps and flown.keeps[vehicle].faces


def _gas_ns(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """Open time of all valves times their nominal thrust."""
    rows = within(flown.tracks[vehicles[0]].open_valves, span.from_s, span.to_s)
    return Value(float(rows[:, 1].sum()) * flown.thrust_n[vehicles[0]], span.to_s)


def _faults(flown: RunTracks, vehicles: tuple[str, ...], span: Span) -> Value:
    """Faults that were found in the span."""
    found = [
        event.t_s
        for event in flown.events
        if event.kind == "fault" and event.vehicle == vehicles[0] and not event.text.endswith(" ends")
        if span.from_s <= event.t_s <= span.to_s
    ]
    return Value(float(len(found)), found[0] if found else span.to_s)


QUANTITIES: Mapping[str, Quantity] = {
    "position_error_rms_mm": Quantity("to the controller's setpoint", deviations.position_error_rms_mm),
    "position_error_max_mm": Quantity("to the controller's setpoint", deviations.position_error_max_mm),
    "heading_error_rms_deg": Quantity("to the controller's setpoint", deviations.heading_error_rms_deg),
    "distance_error_rms_mm": Quantity(
        "a follower's distance", clearances.distance_error_rms_mm, applies=_follows
    ),
    "pointing_error_rms_deg": Quantity(
        "a follower's facing", clearances.pointing_error_rms_deg, applies=_faces
    ),
    "settling_s": Quantity("from the last goal until it has settled", deviations.settling_s),
    "overshoot_mm": Quantity("beyond the goal along the way", deviations.overshoot_mm),
    "gas_ns": Quantity("impulse of all valves, newton-seconds", _gas_ns),
    "least_edge_mm": Quantity("from the hull to the table's edge", clearances.least_edge_mm, least=-math.inf),
    "least_obstacle_mm": Quantity(
        "from the hull to an obstacle",
        clearances.least_obstacle_mm,
        applies=_has_obstacles,
        least=-math.inf,
    ),
    "least_distance_mm": Quantity(
        "between two hulls", clearances.least_distance_mm, is_of_pair=True, least=-math.inf
    ),
    "contacts": Quantity("a hull touches an edge, an obstacle or another hull", clearances.contacts),
    "contact_speed_mm_s": Quantity(
        "of the first contact of a docking", first_contact.contact_speed_mm_s, applies=_docks
    ),
    "contact_lateral_mm": Quantity(
        "of the first contact, from the port's axis", first_contact.contact_lateral_mm, applies=_docks
    ),
    "estimate_error_rms_mm": Quantity("of the position, by truth", deviations.estimate_error_rms_mm),
    "estimate_error_max_mm": Quantity("of the position, by truth", deviations.estimate_error_max_mm),
    "faults": Quantity("faults found", _faults),
}
"""THE TABLE."""


def every_quantity(flown: RunTracks) -> Iterator[tuple[str, Value]]:
    """Each quantity over the whole run, by its column: ``alpha.gas_ns``, ``alpha-beta.least_distance_mm``."""
    whole = Span(0.0, flown.duration_s)
    for vehicle in flown.tracks:
        for name, row in QUANTITIES.items():
            if not row.is_of_pair and row.applies(flown, vehicle):
                yield f"{vehicle}.{name}", row.of(flown, (vehicle,), whole)
    for pair in itertools.combinations(flown.tracks, 2):
        for name, row in QUANTITIES.items():
            if row.is_of_pair:
                yield f"{pair[0]}-{pair[1]}.{name}", row.of(flown, pair, whole)
