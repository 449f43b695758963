"""What `tools/formation_flights.py` found: formation flight over seeds, a row for each limit.

The flights are flown by ``make bench-full``; this reads their results. A limit on a figure of each flight is
kept where 95 of 100 flights keep it.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from bench.rows import ROOT, Bench, Row
from groundstation.control.coasting import fastest, least_gas

FLIGHTS = ROOT / "build" / "formation_flights.jsonl"
WANTED, FEW = 100, 20
SHARE = 0.95
THRUST_N, MASS_KG, TILT_RAD, GRAVITY_M_S2 = 0.44, 11.0, 5e-4, 9.80665
"""Of a pair of valves along body x; nominal, as the scenarios have it."""
PUSH_M_S2, PULL_M_S2 = THRUST_N / MASS_KG, -GRAVITY_M_S2 * TILT_RAD
WAY_M, SPAN_S, HELD_S = 1.0, 20.0, 90.0


def bang_bang_s() -> float:
    """The least time for the way of ``go_to_uphill.toml``, with all of the valves' force."""
    return fastest(WAY_M, PUSH_M_S2, PULL_M_S2).duration_s


def least_impulse_n_s() -> float:
    """The least gas for the way of ``least_gas.toml``, in its time: the integral of what valves must add."""
    phases = least_gas(WAY_M, SPAN_S, PUSH_M_S2, PULL_M_S2)
    return MASS_KG * sum(
        abs(acceleration - PULL_M_S2) * span_s
        for acceleration, span_s in zip(phases.accelerations_m_s2, phases.spans_s, strict=True)
    )


def least_holding_n_s() -> float:
    """The least gas for holding station in ``station_keeping.toml``: the slope's pull over the time."""
    return MASS_KG * -PULL_M_S2 * HELD_S


@dataclass(frozen=True, slots=True)
class Figure:
    """A limit on a figure of each flight.

    Attributes:
        what: For people.
        subject: Whose flights.
        names: Of the figure; where there are several, the worst counts.
        unit: Of what is shown.
        must: Limit.
        aim: Better.
        over: What the figure is divided by.
        is_least: The figure has to be larger, not smaller.
    """

    what: str
    subject: str
    names: tuple[str, ...]
    unit: str
    must: float
    aim: float
    over: float = 1.0
    is_least: bool = False


@dataclass(frozen=True, slots=True)
class Success:
    """A limit on how many flights pass.

    Attributes:
        what: For people.
        subject: Whose flights.
        must: Of the wanted number.
        aim: Better.
        wanted: Number of flights.
        below: Figures that make the success, and their limits; where none is given, the verdict does.
    """

    what: str
    subject: str
    must: int
    aim: int
    wanted: int = WANTED
    below: tuple[tuple[str, float], ...] = ()

    def is_one(self, flight: Mapping) -> bool:
        """Whether a flight is a success."""
        if not self.below:
            return flight["verdict"] == "passed"
        return all(flight["figures"].get(name, math.inf) < limit for name, limit in self.below)


def figures() -> tuple[Figure, ...]:
    """THE TABLE of figures, in the order of the page."""
    station = "station keeping, 0.5 mrad, tracker busy 0.6 s"
    round_ = "follower round the perimeter at 6 cm/s"
    ships = ("alpha", "beta", "gamma", "delta", "epsilon")
    gaps = tuple(
        f"{one}-{other}.least_distance_mm" for k, one in enumerate(ships) for other in ships[k + 1 :]
    )
    held = "limits.{}.alpha.{}"
    speed, lateral = "beta.contact_speed_mm_s", "beta.contact_lateral_mm"
    return (
        Figure(f"{station}: position RMS", "station_keeping", (held.format(0, "position_error_rms_mm"),),
               "mm", 1.5, 1.0),
        Figure(f"{station}: farthest off", "station_keeping", (held.format(1, "position_error_max_mm"),),
               "mm", 6.0, 4.0),
        Figure(f"{station}: heading RMS", "station_keeping", (held.format(2, "heading_error_rms_deg"),),
               "deg", 0.05, 0.03),
        Figure(f"{round_}: distance RMS", "perimeter", ("limits.1.beta.distance_error_rms_mm",),
               "mm", 8.0, 4.0),
        Figure(f"{round_}: pointing RMS", "perimeter", ("limits.2.beta.pointing_error_rms_deg",),
               "deg", 0.5, 0.25),
        Figure(f"gas over the least possible, {station} ({least_holding_n_s():.2f} N s in {HELD_S:g} s)",
               "station_keeping", (held.format(3, "gas_ns"),), "", 2.0, 1.4, least_holding_n_s()),
        Figure(f"gas over the least possible, 1 m uphill in {SPAN_S:g} s ({least_impulse_n_s():.2f} N s)",
               "least_gas", (held.format(0, "gas_ns"),), "", 2.0, 1.4, least_impulse_n_s()),
        Figure(f"go-to 1 m along body x, uphill: time over bang-bang ({bang_bang_s():.2f} s)", "go_to",
               ("alpha.settling_s",), "", 1.4, 1.2, bang_bang_s()),
        Figure("go-to 1 m along body x, uphill: overshoot", "go_to", ("alpha.overshoot_mm",),
               "mm", 15.0, 5.0),
        Figure("docking, still: contact speed", "dock_still", (speed,), "mm/s", 20.0, 10.0),
        Figure("docking, still: lateral error", "dock_still", (lateral,), "mm", 10.0, 5.0),
        Figure("docking, turning: contact speed", "dock_turning", (speed,), "mm/s", 20.0, 10.0),
        Figure("docking, turning: lateral error", "dock_turning", (lateral,), "mm", 10.0, 5.0),
        Figure("five-ship swap: least distance between hulls", "swap", gaps, "mm", 50.0, 80.0, is_least=True),
        Figure("silence of the commander to braking thrust", "silence", ("silent_s",), "s", 0.3, 0.15),
    )  # fmt: skip


SOFT = (("beta.contact_speed_mm_s", 20.0), ("beta.contact_lateral_mm", 10.0))
"""Of the first contact."""
SUCCESSES = (
    Success("one valve stuck closed: holds station", "stuck_closed", FEW, FEW, FEW),
    Success("one valve stuck open: holds, or brakes and lands on the table", "stuck_open", FEW, FEW, FEW),
    Success("docking, still: first contact within its limits", "dock_still", 97, 100, below=SOFT),
    Success("docking, turning 3 deg/s: first contact within its limits", "dock_turning", 92, 98, below=SOFT),
    Success("five-ship swap within 90 s", "swap", 95, 100),
)


def measure(bench: Bench) -> list[Row]:
    """A row for each limit."""
    del bench
    flights = _read(FLIGHTS)
    return [figure_row(figure, flights.get(figure.subject, [])) for figure in figures()] + [
        success_row(success, flights.get(success.subject, [])) for success in SUCCESSES
    ]


def figure_row(figure: Figure, flights: list[Mapping]) -> Row:
    """The figure's 95 % of the flights, and the worst; one that is missing counts as infinitely bad."""
    sense, comparison = (-1.0, "at least ") if figure.is_least else (1.0, "")
    limit = f"{comparison}{figure.must:g} {figure.unit}".rstrip() + f" in 95 of 100, aim {figure.aim:g}"
    if not flights:
        return Row(figure.what, limit, "not flown; make bench-full flies it", ok=False)
    bad = [
        max(sense * flight["figures"].get(name, sense * math.inf) / figure.over for name in figure.names)
        for flight in flights
    ]
    within = sense * float(np.quantile(bad, SHARE, method="higher"))
    median, worst = sense * float(np.median(bad)), sense * max(bad)
    shown = f"{within:.3g} {figure.unit}".rstrip()
    measured = f"{shown} (median {median:.3g}, worst {worst:.3g} of {len(flights)})"
    return Row(figure.what, limit, measured, sense * within <= sense * figure.must)


def success_row(success: Success, flights: list[Mapping]) -> Row:
    """How many succeeded, and how many ended badly later; in too few flights success shows nothing."""
    good = [flight for flight in flights if success.is_one(flight)]
    later = sum(flight["verdict"] != "passed" for flight in good)
    limit = f"{success.must} of {success.wanted}, aim {success.aim}"
    measured = f"{len(good)} of {len(flights)}" + (f"; {later} of them failed later" if later else "")
    if len(flights) < success.wanted:
        return Row(success.what, limit, f"{measured}, too little was flown", ok=None if flights else False)
    return Row(success.what, limit, measured, len(good) * success.wanted >= success.must * len(flights))


def _read(path: Path) -> Mapping[str, list[Mapping]]:
    found: dict[str, list[Mapping]] = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        row = json.loads(line)
        found.setdefault(row["subject"], []).append(row)
    return MappingProxyType(found)
