"""Differential evolution rand/1/bin, as Storn and Price published it; a whole generation in one call.

``v = x_r1 + F (x_r2 - x_r3)``, binomial crossover with CR, at least one parameter always from v; the better
of trial and parent stays. A generation is judged together, so trials do not see each other's success (scipy
calls that ``updating="deferred"``).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Cost = Callable[[Floats], Floats]
"""Takes parameters (n, d), gives costs (n,)."""


@dataclass(frozen=True, slots=True)
class EvolutionSettings:
    """Settings; the publication gives none of them, these are assumed.

    Attributes:
        population: Members.
        weight: F.
        crossover: CR.
        generations: At most.
        accuracy: The search ends when the worst member costs no more than this share above the best: the
            population has come together. The publication ends at a given accuracy of the pixels, of which
            it states nothing; see `enough`.
        enough: The search ends when the best costs no more than this, too; the published rule.
    """

    population: int = 40
    weight: float = 0.6
    crossover: float = 0.9
    generations: int = 150
    accuracy: float = 1e-6
    enough: float = 0.0

    def __post_init__(self) -> None:
        if self.population < 4:
            raise ValueError(f"population is {self.population}, rand/1/bin needs at least 4")
        if not 0.0 < self.weight <= 2.0:
            raise ValueError(f"weight is {self.weight:g}, expected above 0 to 2")
        if not 0.0 <= self.crossover <= 1.0:
            raise ValueError(f"crossover is {self.crossover:g}, expected 0 to 1")


@dataclass(frozen=True, slots=True, eq=False)
class Evolved:
    """What a search found.

    Attributes:
        parameters: Of the best member, (d,).
        cost: Its cost.
        generations: How many it took.
        evaluations: How many costs were asked for.
    """

    parameters: Floats
    cost: float
    generations: int
    evaluations: int


def evolve(
    cost: Cost, low: Floats, high: Floats, settings: EvolutionSettings, rng: np.random.Generator
) -> Evolved:
    """Search a box.

    Args:
        cost: Of a whole generation.
        low: Corner of the box, (d,).
        high: The other corner, (d,); members that leave it through crossover are put back at random inside.
        settings: Of the search.
        rng: Randomness.
    """
    size, width = settings.population, len(low)
    members = low + rng.random((size, width)) * (high - low)
    costs = cost(members)
    rows = np.arange(size)
    generation = 0
    for generation in range(1, settings.generations + 1):
        best, worst = float(costs.min()), float(costs.max())
        if best <= settings.enough or worst - best <= settings.accuracy * abs(best):
            generation -= 1
            break
        # three others, all different from each other and from the parent
        draw = rng.random((size, size))
        draw[rows, rows] = 2.0
        others = np.argpartition(draw, 2, axis=1)[:, :3]
        trial = members[others[:, 0]] + settings.weight * (members[others[:, 1]] - members[others[:, 2]])
        keep = rng.random((size, width)) >= settings.crossover
        keep[rows, rng.integers(width, size=size)] = False
        trial = np.where(keep, members, trial)
        outside = (trial < low) | (trial > high)
        if outside.any():
            trial = np.where(outside, low + rng.random((size, width)) * (high - low), trial)
        costs_trial = cost(trial)
        better = costs_trial <= costs
        members[better], costs[better] = trial[better], costs_trial[better]
    best_row = int(costs.argmin())
    return Evolved(members[best_row].copy(), float(costs[best_row]), generation, size * (generation + 1))
