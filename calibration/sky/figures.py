"""Figures of the sky's calibrations. Matplotlib loads only when one is drawn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from groundstation.files.png import new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from calibration.sky.residual_structure import ResidualStructure

Array = NDArray[np.float64]


def draw_residuals(residual_px: Array, structure: ResidualStructure | None, title: str) -> Figure:
    """Residuals (m, 2): as a cloud, their distribution, and their means over the picture."""
    figure = new_figure(15.0 if structure is not None else 10.0, 4.5)
    axes = figure.subplots(1, 3 if structure is not None else 2)
    draw_cloud(axes[0], residual_px, title)
    draw_distribution(axes[1], residual_px)
    if structure is not None:
        _means(axes[2], structure)
    return figure


def draw_delay(t_s: Array, residual_rad: Array, rate_rad_s: Array, delay_s: float) -> Figure:
    """What is left of the headings after the delay: over time, and over the turn rate."""
    figure = new_figure(11.0, 4.2)
    over_time, over_rate = figure.subplots(1, 2, sharey=True)
    over_time.plot(t_s, np.degrees(residual_rad), ".")
    over_time.set(xlabel="t (s)", ylabel="heading residual (deg)", title=f"delay {1e3 * delay_s:.2f} ms")
    over_rate.plot(np.degrees(rate_rad_s), np.degrees(residual_rad), ".")
    over_rate.set(xlabel="turn rate (deg/s)", title="a slope here is a delay that is left")
    for axes in (over_time, over_rate):
        axes.grid(visible=True, alpha=0.3)
    return figure


def draw_survey(
    star_m: Array,
    sigma_m: Array,
    times_seen: NDArray[np.int64],
    pose: Array,
    residual_px: Array,
    structure: ResidualStructure,
    verified_mm: Array,
) -> Figure:
    """The map with each star's uncertainty, the residuals, and how other pictures fit the map.

    Args:
        star_m: Positions, shape (s, 2).
        sigma_m: One sigma of the shape, shape (s, 2).
        times_seen: Pictures of each star, shape (s,).
        pose: Where the pictures were taken, shape (f, 3).
        residual_px: Of the adjustment, shape (m, 2).
        structure: Their means over the picture.
        verified_mm: Star minus spot in pictures that the map was made without, shape (k, 2); may be empty.
    """
    figure = new_figure(14.0, 9.0)
    sky, means, cloud, verified = figure.subplots(2, 2).ravel()
    sky.plot(pose[:, 0], pose[:, 1], "-", color="0.8", linewidth=1, zorder=0)
    dots = sky.scatter(
        star_m[:, 0], star_m[:, 1], s=8 + 4 * times_seen, c=1e3 * sigma_m.mean(axis=1), cmap="viridis_r"
    )
    figure.colorbar(dots, ax=sky, label="one sigma per axis (mm)")
    sky.set(
        xlabel="x (m)",
        ylabel="y (m)",
        aspect="equal",
        title=f"{len(star_m)} stars; larger: seen more often; line: the sweep",
    )
    _means(means, structure)
    draw_cloud(cloud, residual_px, "all pictures")
    if len(verified_mm):
        verified.hist(np.hypot(verified_mm[:, 0], verified_mm[:, 1]), bins=60)
        rms = float(np.sqrt((verified_mm**2).mean()))
        verified.set(title=f"pictures the map was made without: RMS {rms:.3f} mm per axis")
    else:
        verified.set(title="no verification")
    verified.set(xlabel="star to spot on the ceiling (mm)", ylabel="sightings")
    return figure


def draw_cloud(axes: Axes, residual_px: Array, title: str) -> None:
    """Residuals (m, 2) of pixels as dots."""
    axes.plot(residual_px[:, 0], residual_px[:, 1], ".", markersize=2)
    axes.set(xlabel="u residual (px)", ylabel="v residual (px)", aspect="equal", title=title)
    axes.locator_params(nbins=6)
    axes.grid(visible=True, alpha=0.3)


def draw_distribution(axes: Axes, residual_px: Array) -> None:
    """Their distribution beside a Gaussian one."""
    sigma = max(float(np.sqrt((residual_px**2).mean())), 1e-9)
    axes.hist(residual_px.ravel(), bins=80, density=True, alpha=0.7)
    axis = np.linspace(-5.0 * sigma, 5.0 * sigma, 200)
    axes.plot(axis, np.exp(-0.5 * (axis / sigma) ** 2) / (sigma * np.sqrt(2.0 * np.pi)))
    axes.set(xlabel="residual (px)", title=f"RMS {sigma:.4f} px per axis")


def _means(axes: Axes, structure: ResidualStructure) -> None:
    """Arrows over the picture: mean residuals of its cells."""
    verdict = "the lens does not fit" if structure.is_wrong else "no structure that matters"
    centre, mean = structure.centre_px, structure.mean_px
    scale = ""
    if len(centre):
        longest = max(float(np.hypot(mean[:, 0], mean[:, 1]).max()), 1e-9)
        reach = max(0.12 * float(np.ptp(centre[:, 0])), 1.0)  # of the longest arrow, in px of the picture
        axes.quiver(*centre.T, *mean.T, angles="xy", scale_units="xy", scale=longest / reach)
        scale = f"; the longest arrow is {longest:.4f} px"
        (left, top), (right, bottom) = centre.min(axis=0) - reach, centre.max(axis=0) + reach
        axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.set(xlabel=f"u (px){scale}", ylabel="v (px)", aspect="equal")
    axes.set_title(
        f"mean residuals over the picture: {structure.systematic_px:.4f} px, {verdict}", fontsize="medium"
    )
