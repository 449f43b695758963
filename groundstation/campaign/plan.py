"""What a campaign flies: its runs, their changes and seeds, and the columns of its rows."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.campaign.errors import CampaignError
from groundstation.recording.software import software
from groundstation.rig.provenance import file_hashes
from groundstation.rig.read import source_of
from groundstation.scenario.compiling import groups_of
from groundstation.scenario.dispersions import Drawn, draw, expanded_keys, laboratory_seed
from groundstation.scenario.flight_log import FlightLog
from groundstation.scenario.judging import flown
from groundstation.scenario.limits import expanded
from groundstation.scenario.loading import Scenario
from groundstation.scenario.quantities import QUANTITIES

HEAD = ("run", "seed", "verdict", "reason")
LIMITS = "limits."
MOST_RUNS = 1_000_000
LARGEST = 1e300


@dataclass(frozen=True, slots=True)
class Sweep:
    """A key that takes values in turn.

    Attributes:
        key: Of the scenario or its rig.
        values: In their order.
    """

    key: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """A campaign before it flies.

    Attributes:
        runs: How many; of a sweep, for each value.
        seed: Of the campaign.
        sweep: None without one.
    """

    runs: int
    seed: int
    sweep: Sweep | None = None

    @property
    def count(self) -> int:
        """Of all runs."""
        return self.runs * (len(self.sweep.values) if self.sweep else 1)

    def changes(self, scenario: Scenario, run: int) -> dict[str, Drawn]:
        """What a run changes, by key: the value of the sweep, then what is drawn."""
        swept = {self.sweep.key: self.sweep.values[run // self.runs]} if self.sweep else {}
        return {**draw(scenario, self.seed, run), **swept}

    def laboratory_seed(self, run: int) -> int:
        """Seed of the laboratory in a run."""
        return laboratory_seed(self.seed, run)

    def keys(self, scenario: Scenario) -> list[str]:
        """Columns of what runs change."""
        swept = [self.sweep.key] if self.sweep else []
        return [*swept, *(key for key, _ in expanded_keys(scenario) if key not in swept)]


def columns_of(scenario: Scenario, plan: Plan) -> tuple[str, ...]:
    """Columns of the rows: known before the first run."""
    limits = (column for column in limit_columns(scenario) if column.startswith(LIMITS))
    return (*HEAD, *plan.keys(scenario), *quantity_columns(scenario), *limits)


def limit_columns(scenario: Scenario) -> Iterator[str]:
    """The column of each limit of each vehicle, in the order of a verdict.

    Over the whole run it is that of the quantity, over a part of it one of its own.
    """
    groups = groups_of(scenario.rig)
    for number, limit in enumerate(scenario.file.limits):
        is_whole = limit.from_s == 0.0 and limit.to_s in (None, scenario.file.duration_s)
        for vehicles in expanded(limit, number, groups):
            column = f"{'-'.join(vehicles)}.{limit.what}"
            yield column if is_whole else f"{LIMITS}{number}.{column}"


def quantity_columns(scenario: Scenario) -> Iterator[str]:
    """Columns of the quantities: ``alpha.gas_ns``, ``alpha-beta.least_distance_mm``."""
    nothing = flown(scenario, FlightLog(tuple(scenario.rig.vehicles)))
    for vehicle in nothing.tracks:
        for name, row in QUANTITIES.items():
            if not row.is_of_pair and row.applies(nothing, vehicle):
                yield f"{vehicle}.{name}"
    for pair in itertools.combinations(nothing.tracks, 2):
        yield from (f"{pair[0]}-{pair[1]}.{name}" for name, row in QUANTITIES.items() if row.is_of_pair)


def parse_sweep(text: str) -> Sweep:
    """Read ``key=a:b:n``.

    Raises:
        CampaignError: It is not so written.
    """
    key, _, span = text.partition("=")
    parts = span.split(":")
    try:
        low, high, count = float(parts[0]), float(parts[1]), int(parts[2])
        if len(parts) != 3 or not key or not 1 <= count <= MOST_RUNS or not abs(low) + abs(high) < LARGEST:
            raise ValueError
    except (ValueError, IndexError):
        raise CampaignError(
            f"--sweep {text!r}: expected key=first:last:number, e.g. laboratory.alpha.mass_kg=10:12:5"
        ) from None
    return Sweep(key, tuple(float(value) for value in np.linspace(low, high, count)))


def identity(scenario: Scenario, plan: Plan) -> Mapping[str, object]:
    """What has to be equal for a campaign to be continued, beside the number of its runs."""
    swept = None if plan.sweep is None else [plan.sweep.key, list(plan.sweep.values), plan.runs]
    return {
        "scenario": scenario.content,
        "rig": source_of(scenario.base).content,
        "files": file_hashes(scenario.base),
        "software": software(),
        "seed": plan.seed,
        "sweep": swept,
    }
