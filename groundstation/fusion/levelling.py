"""Which leg of the table to raise, and by how much, to take its mean slope away."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.fusion.table_map import G_M_S2

Array = NDArray[np.float64]

SIGMAS = 2.0
"""Less than so many standard deviations is no reason to touch a leg."""
COARSEST_M = 2e-5
"""Finer nobody turns the foot of a table."""


@dataclass(frozen=True, slots=True)
class LegAdvice:
    """What to do with one leg."""

    name: str
    raise_m: float
    """Above what it is now; the leg that needs least stays, so this is never below zero."""
    sigma_m: float
    """Against the leg that stays."""

    @property
    def must_be_raised(self) -> bool:
        """Whether it differs from level by more than its uncertainty."""
        return self.raise_m > max(SIGMAS * self.sigma_m, COARSEST_M)


@dataclass(frozen=True, slots=True)
class Levelling:
    """Advice for all legs."""

    legs: tuple[LegAdvice, ...]
    is_level: bool
    """Nothing differs from level by more than its uncertainty."""
    uncertainty_m: float
    """Largest sigma of a leg."""

    def sentences(self) -> list[str]:
        """Return the advice in words."""
        if self.is_level:
            within = max(leg.raise_m + leg.sigma_m for leg in self.legs)
            return [f"The table is level within {1e3 * within:.2f} mm at its legs: leave them."]
        lines = []
        for leg in self.legs:
            spread = f"(± {1e3 * leg.sigma_m:.2f} mm)"
            if not leg.must_be_raised:
                lines.append(f"Leave leg {leg.name} as it is.")
            else:
                lines.append(f"Raise leg {leg.name} by {1e3 * leg.raise_m:.2f} mm {spread}.")
        return lines


def levelling(
    mean_m_s2: tuple[float, float], covariance_m2_s4: Array, legs_m: Mapping[str, tuple[float, float]]
) -> Levelling:
    """Advise how to level a table.

    A vehicle glides downhill, so the surface rises against its acceleration: dh/dx = -ax / g. Raising the
    legs by minus the plane levels it; a common height is free, and chosen so that no leg has to be lowered.

    Args:
        mean_m_s2: mean acceleration over the table, table frame.
        covariance_m2_s4: (2, 2) its covariance.
        legs_m: where the legs stand, table frame.

    Raises:
        ValueError: fewer than three legs, two in one place, or all on a line.
    """
    places = np.array(list(legs_m.values()), dtype=np.float64).reshape(-1, 2)
    if len(places) < 3 or not np.isfinite(places).all():
        raise ValueError(f"a table needs at least three legs with finite places, found {len(places)}")
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if spread[1] < 0.02 * spread[0] or math.isclose(spread[0], 0.0):
        raise ValueError("the legs stand on one line, which leaves the tilt across it undetermined")
    lift = places @ np.asarray(mean_m_s2) / G_M_S2  # minus the height of the plane
    lowest = int(np.argmin(lift))
    apart = places - places[lowest]
    sigma = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", apart, covariance_m2_s4, apart), 0.0)) / G_M_S2
    legs = tuple(
        LegAdvice(name, float(lift[i] - lift[lowest]), float(sigma[i])) for i, name in enumerate(legs_m)
    )
    is_level = not any(leg.must_be_raised for leg in legs)
    return Levelling(legs, is_level, float(sigma.max()))
