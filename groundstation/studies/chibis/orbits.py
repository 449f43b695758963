"""Figures 2.1 and 2.2: relative orbits whose first constant is zero, and is not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import SeparationOrder, fly_separation
from groundstation.relative_navigation.hill import HillConstants, hill_constants, hill_transition
from groundstation.studies.chibis.condition import INERTIA_KG_M2, RATE_RAD_S, TIPS_M
from groundstation.studies.earth import circular_radius_m
from groundstation.studies.plots import Plan
from groundstation.studies.study import Drawn, Number

Floats = NDArray[np.float64]

C1_M = 0.05
RADIAL_M = 1.0
REVOLUTIONS = 3.0
ASSUMED = (
    "the unit of C1, m; an ellipse of 1 m by 2 m; the circular orbit of the published mean motion",
    "both craft integrated about a point mass, beside the closed form of Hill's equations",
)


@dataclass(frozen=True, slots=True, eq=False)
class RelativeOrbit:
    """A relative orbit by closed form, and by integration of both craft.

    Attributes:
        times_s: (n,).
        closed_m: Orbital axes, (n, 3).
        integrated_m: The same, (n, 3).
        constants: Of the start.
    """

    times_s: Floats
    closed_m: Floats
    integrated_m: Floats
    constants: HillConstants


def relative_orbit(c1_m: float, revolutions: float = REVOLUTIONS) -> RelativeOrbit:
    """Return the orbit that begins on top of its ellipse."""
    # published: C1 = 2 z0 + x0'/w with z0 = 2 C1 + C3 and C3 the half axis upwards;
    # its z, x, y are x, y, z here
    up = 2.0 * c1_m + RADIAL_M
    place = np.array((up, 0.0, 0.0))
    pace = np.array((0.0, RATE_RAD_S * (c1_m - 2.0 * up), 0.0))
    times = np.linspace(0.0, revolutions * 2.0 * np.pi / RATE_RAD_S, 361)
    still = np.eye(3)
    # a circular orbit of this rate about a point mass, so that the two differ by what is linearised only
    radius = circular_radius_m(RATE_RAD_S)
    order = SeparationOrder(
        times, radius, place, pace, INERTIA_KG_M2, still, np.zeros(3), still, 16.0, TIPS_M, size_px=(16, 16)
    )
    flown = fly_separation(order)
    closed = np.array(
        [hill_transition(RATE_RAD_S, t) @ np.concatenate((place, pace)) for t in times.tolist()]
    )
    return RelativeOrbit(
        times, closed[:, :3], flown.positions_orbital_m, hill_constants(place, pace, RATE_RAD_S)
    )


def draw_orbits(data: Mapping[str, Any]) -> Drawn:
    """Figures 2.1 and 2.2."""
    del data
    pictures, numbers, largest_off_m = [], [], 0.0
    for c1 in (0.0, C1_M):
        found = relative_orbit(c1)
        words = f"C1 = {c1:g} m"
        pictures.append(
            (f"{words}, three revolutions; the asterisk is the craft with the camera.", _plane(found, words))
        )
        turn = len(found.times_s) // 3
        drift = found.integrated_m[turn, 1] - found.integrated_m[0, 1]
        up, along, _ = found.constants.semi_axes_m
        off_m = float(np.linalg.norm(found.closed_m - found.integrated_m, axis=1).max())
        largest_off_m = max(largest_off_m, off_m)
        long_m = np.ptp(found.integrated_m[:turn, 1] - drift * np.arange(turn) / turn)
        numbers += [
            Number(
                f"{words}: wanders along the track, closed form, m a revolution",
                ours=found.constants.drift_m_rev + 0.0,
                assumed="-6 pi C1",
            ),
            Number(f"{words}: wanders along the track, integrated, m a revolution", ours=float(drift)),
            Number(f"{words}: half axes along over up, closed form", ours=along / up),
            Number(
                f"{words}: half axes along over up, integrated",
                2.0,
                float(long_m / np.ptp(found.integrated_m[:turn, 0])),
                assumed="published by its formulas",
                ratio=1.01,
            ),
            Number(f"{words}: closed form off the integrated way, largest, m", ours=off_m),
        ]
    sentences = (
        f"With C1 = 0 the ellipse, twice as long as high, closes; with C1 = {C1_M:g} m it wanders by -6 pi "
        f"C1 = {-6.0 * np.pi * C1_M:.2f} m in each revolution. What the linear equations leave out is at "
        f"most {1e6 * largest_off_m:.2g} micrometres here."
    )
    return Drawn(pictures, numbers, sentences)


def _plane(found: RelativeOrbit, words: str) -> str:
    """The plane of the orbit: along-track to the right, up."""
    along, up = found.integrated_m[:, 1], found.integrated_m[:, 0]
    room = 0.3
    plan = Plan(
        (float(along.min()) - room, float(along.max()) + room),
        (float(up.min()) - room, float(up.max()) + room),
        ("along-track, m", "up, m"),
    )
    parts = [
        plan.way(along, up, "v2 thick"),
        plan.way(found.closed_m[:, 1], found.closed_m[:, 0], "v1"),
        plan.asterisks(np.zeros(1), np.zeros(1), "v5"),
    ]
    return plan.picture(parts, (("v2 thick", "integrated"), ("v1", "Hill's closed form")), words)
