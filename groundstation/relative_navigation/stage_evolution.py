"""Rates of a stage by the published search: differential evolution over its attitude and rate.

Simakov, Ustyugov 2016: parameters are changed until the model's pixels agree with the measured ones. What is
evolved is not stated; here attitude at time 0 and rate together, over all frames of a run, so that the model
of the precession is in the search as it is in the least squares of `stage_spin`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.relative_navigation.evolution import EvolutionSettings, evolve
from groundstation.relative_navigation.precession import precess
from groundstation.relative_navigation.rotations import turn, turns
from groundstation.relative_navigation.stage_spin import Stage, StageRun

Floats = NDArray[np.float64]

SETTINGS = EvolutionSettings(population=40, weight=0.6, crossover=0.9, generations=300, accuracy=1e-4)
"""Assumed: none is published. The end: no member costs more than a ten-thousandth above the best."""
HALF_TURN_RAD = 0.25
HALF_RATE_RAD_S = np.radians(6.0)
"""Half sides of the box about the expected attitude, and about rest; assumed."""
_BEHIND = 1e12


@dataclass(frozen=True, slots=True, eq=False)
class StageSearch:
    """What a search found.

    Attributes:
        rate_rad_s: At time 0, body axes, (3,).
        start: Inertial from body at time 0, (3, 3).
        rms_px: Root of the mean squared residual.
        evaluations: Costs that were asked for.
    """

    rate_rad_s: Floats
    start: Floats
    rms_px: float
    evaluations: int


def search_stage(
    stage: Stage,
    run: StageRun,
    rng: np.random.Generator,
    settings: EvolutionSettings = SETTINGS,
    start: Floats | None = None,
) -> StageSearch:
    """Search the box about an expected attitude and about rest.

    Args:
        stage: What is known.
        run: What was seen.
        rng: Randomness of the search.
        settings: Of it.
        start: The expected attitude, (3, 3); the inertial axes if nothing is given.
    """
    around = np.eye(3) if start is None else start
    instants, which = np.unique(run.times_s, return_inverse=True)
    depths = stage.camera.start_m + stage.camera.speed_m_s * run.times_s

    def cost(members: Floats) -> Floats:
        turned = precess(turns(members[:, :3]) @ around, members[:, 3:], stage.inertia, instants)
        points = np.einsum("gnij,nj->gni", turned[:, which], stage.markers_m[run.marker])
        depth = depths - points[:, :, 0]
        off = stage.camera.f_px * points[:, :, 1:] / depth[:, :, None] - run.pixels
        sums: Floats = np.einsum("gni,gni->g", off, off)
        return np.where(depth.min(axis=1) > 0.0, sums, _BEHIND)

    half = np.concatenate((np.full(3, HALF_TURN_RAD), np.full(3, HALF_RATE_RAD_S)))
    found = evolve(cost, -half, half, settings, rng)
    rms = float(np.sqrt(found.cost / run.pixels.size))
    return StageSearch(found.parameters[3:], turn(found.parameters[:3]) @ around, rms, found.evaluations)
