"""The data sets that the fusion is measured on, made once per run."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import fusion_truth

from bench.rows import Bench

FIRST_SEED = 201
MIN_SEEDS = 6


@dataclass(frozen=True, slots=True)
class Scenario:
    """One kind of flight.

    Attributes:
        name: As people read it.
        kind: As the generator calls it.
        duration_s: Length, with 10 s at rest at the beginning.
        wrong_share: Share of star fixes that are wrong, unmarked.
    """

    name: str
    kind: str
    duration_s: float
    wrong_share: float = 0.02


SCENARIOS = (
    Scenario("station", "station", 100.0),
    Scenario("drift", "drift", 100.0),
    Scenario("spin", "spin", 70.0),
    Scenario("perimeter", "perimeter", 130.0),
    Scenario("outage", "outage", 100.0),
)
WRONG_FIXES = Scenario("10 % wrong fixes", "perimeter", 130.0, 0.1)


def folders_of(bench: Bench, scenario: Scenario) -> Sequence[Path]:
    """Folders of one scenario, a seed each; at least six seeds."""
    folders = []
    seeds = range(FIRST_SEED, FIRST_SEED + max(MIN_SEEDS, bench.seeds))
    for seed in seeds:
        folder = bench.folder / "fusion" / f"{scenario.kind}_{scenario.wrong_share:g}_{seed}"
        if not folder.exists():
            bench.say(f"fusion: making {scenario.name}, seed {seed - FIRST_SEED + 1} of {len(seeds)}")
            laboratory = fusion_truth.Laboratory(
                scenario=scenario.kind,
                seed=seed,
                duration_s=scenario.duration_s,
                wrong_share=scenario.wrong_share,
            )
            fusion_truth.write(fusion_truth.make(laboratory), folder)
        folders.append(folder)
    return folders
