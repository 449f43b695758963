"""Pictures of relative orbits: the ellipse of a bounded one, and how it wanders where C1 is not zero."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from groundstation.files.png import new_figure
from groundstation.relative_navigation.hill import hill_constants, hill_transition

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 600


def draw_relative_orbit(
    position_m: NDArray[np.float64], velocity_m_s: NDArray[np.float64], rate_rad_s: float, revolutions: float
) -> Figure:
    """Draw the plane of the orbit, along-track and up, as the published figures 2.1 and 2.2 do.

    Args:
        position_m: At time 0, orbital axes, (3,).
        velocity_m_s: At time 0, orbital axes, (3,).
        rate_rad_s: Of the orbit.
        revolutions: How many are drawn.

    Raises:
        ValueError: The rate is not above zero.
    """
    constants = hill_constants(position_m, velocity_m_s, rate_rad_s)
    times = np.linspace(0.0, revolutions * 2.0 * np.pi / rate_rad_s, POINTS)
    state = np.concatenate((position_m, velocity_m_s))
    places = np.array([(hill_transition(rate_rad_s, float(t)) @ state)[:2] for t in times])
    centres = np.array([constants.centre_m(float(t)) for t in times])
    figure = new_figure(7.0, 5.0)
    axes = figure.subplots()
    axes.plot(places[:, 1], places[:, 0], label="relative orbit")
    axes.plot(centres[:, 0], centres[:, 1], ":", color="0.5", label="centre of the ellipse")
    axes.plot(*places[0, ::-1], "o", color="tab:blue")
    axes.plot(0.0, 0.0, "k+", label="craft with the camera")
    words = "bounded" if constants.is_bounded() else f"wanders {constants.drift_m_rev:.3g} m a revolution"
    axes.set_title(f"C1 = {constants.c1:.4g} m: {words}")
    axes.set_xlabel("along-track, m")
    axes.set_ylabel("up, m")
    axes.set_aspect("equal")
    axes.legend(fontsize=8)
    return figure
