"""Figures 2.1 and 2.2: relative orbits whose first constant is zero, and is not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.laboratory.separations import SeparationOrder, fly_separation
from groundstation.relative_navigation.hill import HillConstants, hill_constants, hill_transition
from groundstation.studies.chibis.condition import INERTIA_KG_M2, RATE_RAD_S, SEMI_MAJOR_AXIS_M, TIPS_M
from groundstation.studies.plots import Plan
from groundstation.studies.study import Drawn, Number

Floats = NDArray[np.float64]

C1_M = 0.05
RADIAL_M = 1.0
REVOLUTIONS = 3.0
ASSUMED = (
    "the unit of C1, m; an ellipse of 1 m by 2 m; the circular orbit of the published mean motion",
    "ours: the closed form of Hill's equations; beside it both craft integrated about a point mass",
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
    # C1 = 2 z0 + x0'/w with z0 = 2 C1 + C3 and C3 the half axis upwards
    up = 2.0 * c1_m + RADIAL_M
    place = np.array((up, 0.0, 0.0))
    pace = np.array((0.0, RATE_RAD_S * (c1_m - 2.0 * up), 0.0))
    times = np.linspace(0.0, revolutions * 2.0 * np.pi / RATE_RAD_S, 361)
    still = np.eye(3)
    # a circular orbit of this rate about a point mass, so that the two differ by what is linearised only
    radius = SEMI_MAJOR_AXIS_M * _circle_share()
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


def _circle_share() -> float:
    """Radius of the circle with the published rate about a point mass, as a share of the mean axis."""
    return float(np.cbrt(3.986004418e14 / RATE_RAD_S**2) / SEMI_MAJOR_AXIS_M)


def draw_orbits(data: Mapping[str, Any]) -> Drawn:
    """Figures 2.1 and 2.2."""
    del data
    pictures, numbers = [], []
    for c1 in (0.0, C1_M):
        found = relative_orbit(c1)
        words = f"C1 = {c1:g} m"
        pictures.append(
            (f"{words}, three revolutions; the asterisk is the craft with the camera.", _plane(found, words))
        )
        turn = len(found.times_s) // 3
        drift = found.integrated_m[turn, 1] - found.integrated_m[0, 1]
        up, along, _ = found.constants.semi_axes_m
        numbers += [
            Number(
                f"{words}: wanders along the track, m a revolution",
                ours=found.constants.drift_m_rev + 0.0,
                default=float(drift),
                assumed="-6 pi C1; default: both craft integrated",
            ),
            Number(
                f"{words}: half axes along over up",
                2.0,
                along / up,
                float(
                    np.ptp(found.integrated_m[:turn, 1] - drift * np.arange(turn) / turn)
                    / np.ptp(found.integrated_m[:turn, 0])
                ),
                ratio=1.01,
            ),
            Number(
                f"{words}: closed form off the integrated way, largest, m",
                ours=float(np.linalg.norm(found.closed_m - found.integrated_m, axis=1).max()),
            ),
        ]
    sentences = (
        "With C1 = 0 the ellipse, twice as long as high, closes; with 0.05 m it wanders by -6 pi C1, a "
        "metre, in each revolution. At these distances what the linear equations leave out is a matter of "
        "micrometres."
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
