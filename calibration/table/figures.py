"""The figure of a table map: waves with arrows and track, relief, uncertainty, what to do with the legs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from calibration.table.flight_log import FlightLog
from groundstation.files.png import new_figure
from groundstation.fusion.levelling import Levelling
from groundstation.fusion.table_map import G_M_S2, TableMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Legs = Mapping[str, tuple[float, float]]

UNKNOWN = 0.6
"""Where the sigma is above this share of the waviness the map is veiled: nobody was there."""
ARROWS = 22
"""Along the longer side."""
ARROW_STEPS = 1.4
"""Length of the longest arrow in distances between arrows."""


def draw_map(
    made: TableMap,
    waviness_m_s2: float,
    logs: Sequence[FlightLog],
    legs: Legs,
    advice: Levelling | None,
) -> Figure:
    """Draw a map."""
    figure = new_figure(15.0, 8.6)
    figure.set_layout_engine("constrained", h_pad=0.1)
    places = figure.add_gridspec(2, 2, width_ratios=[1.9, 1.0], hspace=0.12)
    veil = np.hypot(made.sigma_x_m_s2, made.sigma_y_m_s2) / np.sqrt(2.0) > UNKNOWN * waviness_m_s2
    _draw_waves(figure, figure.add_subplot(places[:, 0]), made, veil, logs, legs, advice)
    _draw_relief(figure, figure.add_subplot(places[0, 1]), made, veil)
    _draw_sigma(figure, figure.add_subplot(places[1, 1]), made, logs)
    return figure


def _draw_waves(
    figure: Figure,
    axes: Axes,
    made: TableMap,
    veil: NDArray[np.bool_],
    logs: Sequence[FlightLog],
    legs: Legs,
    advice: Levelling | None,
) -> None:
    wave_x, wave_y = made.ax_m_s2 - made.mean_m_s2[0], made.ay_m_s2 - made.mean_m_s2[1]
    size = 1e3 * np.hypot(wave_x, wave_y)
    largest = float((size[~veil] if (~veil).any() else size).max())
    image = axes.imshow(
        size, origin="lower", extent=_extent(made), cmap="YlOrRd", vmin=0.0, vmax=largest,
        interpolation="bilinear",
    )  # fmt: skip
    bar = figure.colorbar(image, ax=axes, location="bottom", shrink=0.9, aspect=40, pad=0.07)
    bar.set_label("acceleration about the mean, mm/s² (below) and mrad (above)")
    mrad = bar.ax.twiny()
    mrad.set_xlim(0.0, largest / G_M_S2)
    mrad.tick_params(labelsize=8)
    _draw_track(axes, logs)
    _draw_arrows(axes, made, veil, wave_x, wave_y)
    _veil(axes, made, veil)
    _draw_legs(axes, made, legs, advice)
    mean, sigma = 1e3 * np.array(made.mean_m_s2), 1e3 * np.sqrt(made.mean_covariance_m2_s4.diagonal())
    title = (
        f"Mean slope x {mean[0]:+.2f} ± {sigma[0]:.2f}, y {mean[1]:+.2f} ± {sigma[1]:.2f} mm/s² "
        f"({mean[0] / G_M_S2:+.3f}, {mean[1] / G_M_S2:+.3f} mrad)"
    )
    if advice is not None and advice.is_level:
        title += "\n" + advice.sentences()[0]
    axes.set_title(title, fontsize=10, loc="left")
    _frame(axes, made)
    corners = [(made.x_m[0], made.y_m[0]), (made.x_m[-1], made.y_m[-1]), *legs.values()]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])


def _draw_legs(axes: Axes, made: TableMap, legs: Legs, advice: Levelling | None) -> None:
    if advice is None:
        return
    for leg in advice.legs:
        x, y = legs[leg.name]
        axes.plot(x, y, "s", color="tab:blue", markersize=9, zorder=5, clip_on=False)
        words = f"raise {leg.name} by {1e3 * leg.raise_m:.2f} ± {1e3 * leg.sigma_m:.2f} mm"
        text = axes.annotate(
            words if leg.must_be_raised else f"{leg.name} stays",
            (x, y),
            textcoords="offset points",
            xytext=(0, 9 if y <= made.y_m.mean() else -15),
            ha="left" if x < made.x_m.mean() else "right",
            fontsize=9,
            color="tab:blue",
            zorder=6,
            bbox={"boxstyle": "round,pad=0.2", "fc": "white", "ec": "none", "alpha": 0.85},
        )
        text.set_in_layout(False)


def _draw_arrows(axes: Axes, made: TableMap, veil: NDArray[np.bool_], wave_x: Array, wave_y: Array) -> None:
    every = max(1, round(max(made.ax_m_s2.shape) / ARROWS))
    rows, columns = np.meshgrid(
        np.arange(every // 2, len(made.y_m), every), np.arange(every // 2, len(made.x_m), every)
    )
    shown = ~veil[rows, columns]
    rows, columns = rows[shown], columns[shown]
    if not len(rows):
        return
    shown_x, shown_y = wave_x[rows, columns], wave_y[rows, columns]
    longest = float(np.hypot(shown_x, shown_y).max())
    axes.quiver(
        made.x_m[columns], made.y_m[rows], shown_x, shown_y, angles="xy", scale_units="xy",
        scale=max(longest, 1e-12) / (ARROW_STEPS * every * made.step_m), color="0.15", width=0.0022, zorder=4,
    )  # fmt: skip


def _draw_relief(figure: Figure, axes: Axes, made: TableMap, veil: NDArray[np.bool_]) -> None:
    height = 1e6 * made.height_m
    reach = float(np.abs(height[~veil]).max()) if (~veil).any() else float(np.abs(height).max())
    image = axes.imshow(
        height, origin="lower", extent=_extent(made), cmap="RdBu_r", vmin=-reach, vmax=reach,
        interpolation="bilinear",
    )  # fmt: skip
    axes.contour(made.x_m, made.y_m, height, levels=9, colors="0.3", linewidths=0.4)
    figure.colorbar(image, ax=axes, shrink=0.9, pad=0.02).set_label("height about the plane, µm")
    _veil(axes, made, veil)
    axes.set_title("Relief", fontsize=10, loc="left")
    _frame(axes, made)


def _draw_sigma(figure: Figure, axes: Axes, made: TableMap, logs: Sequence[FlightLog]) -> None:
    sigma = 1e3 * np.hypot(made.sigma_x_m_s2, made.sigma_y_m_s2) / np.sqrt(2.0)
    image = axes.imshow(
        sigma, origin="lower", extent=_extent(made), cmap="viridis_r", vmin=0.0, interpolation="bilinear"
    )
    figure.colorbar(image, ax=axes, shrink=0.9, pad=0.02).set_label("sigma per axis, mm/s²")
    _draw_track(axes, logs)
    axes.set_title(f"Uncertainty, {made.provenance.flown_s:.0f} s of flight", fontsize=10, loc="left")
    _frame(axes, made)


def _draw_track(axes: Axes, logs: Sequence[FlightLog]) -> None:
    for log in logs:
        place = log.position_table_m[:: max(1, len(log.end_s) // 4000)]
        axes.plot(place[:, 0], place[:, 1], color="tab:blue", linewidth=0.6, alpha=0.6)


def _veil(axes: Axes, made: TableMap, veil: NDArray[np.bool_]) -> None:
    if veil.any():
        cover: Any = np.zeros((*veil.shape, 4))
        cover[veil] = (0.85, 0.85, 0.85, 0.85)
        axes.imshow(cover, origin="lower", extent=_extent(made), interpolation="nearest", zorder=3)


def _extent(made: TableMap) -> tuple[float, float, float, float]:
    half = 0.5 * made.step_m
    x, y = made.x_m, made.y_m
    return float(x[0]) - half, float(x[-1]) + half, float(y[0]) - half, float(y[-1]) + half


def _frame(axes: Axes, made: TableMap) -> None:
    axes.set_xlim(made.x_m[0], made.x_m[-1])
    axes.set_ylim(made.y_m[0], made.y_m[-1])
    axes.set_aspect("equal")
    axes.set_xlabel("table x, m")
    axes.set_ylabel("table y, m")
