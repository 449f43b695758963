"""The figure of an estimated flight: each part of the state over time, with the fixes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from groundstation.files.png import new_figure
from groundstation.fusion.estimator import FixOutcome, PlanarState
from groundstation.fusion.flight_data import FlightData

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
NS = 1e9
EDGE_SHARE = 0.15
"""Of the estimate's span, around it: fixes beyond lie at the edge."""
HEADING = 4
COLUMNS = (
    ("x_m", "x, m", 2),
    ("y_m", "y, m", 3),
    ("heading_rad", "heading, rad", HEADING),
    ("vx_m_s", "x velocity, m/s", None),
    ("vy_m_s", "y velocity, m/s", None),
    ("rate_rad_s", "rate, rad/s", None),
)
"""Of a state: name, label, column of the fixes that it stands beside."""


def draw_estimate(
    data: FlightData, states: Sequence[PlanarState | None], accounts: Sequence[FixOutcome]
) -> Figure:
    """Draw each part of the state over time; fixes at their exposures, used ones grey, the others red."""
    figure = new_figure(11.0, 9.0)
    axes = figure.subplots(len(COLUMNS) // 2, 2, sharex=True)
    t_s = np.array([np.nan if state is None else state.t_ns / NS for state in states])
    used = {account.t_exposure_ns for account in accounts if account.used}
    for place, (name, label, column) in zip(axes.T.ravel(), COLUMNS, strict=True):
        values = np.array([np.nan if state is None else getattr(state, name) for state in states])
        low, high = _span(values)
        if column is not None:
            _draw_fixes(place, data.stars, column, (t_s, values), used, (low, high))
        place.plot(t_s, values, "-", color="tab:blue", linewidth=1.0, label="estimate")
        place.set_ylim(low, high)
        place.set_ylabel(label)
    axes[0, 0].legend(loc="upper right", fontsize=8, ncols=3)
    for place in axes[-1]:
        place.set_xlabel("time, s")
    return figure


def _span(values: Array) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if not len(known):
        return -1.0, 1.0
    low, high = float(known.min()), float(known.max())
    room = EDGE_SHARE * (high - low) or 0.1
    return low - room, high + room


def _draw_fixes(
    place: Any,  # noqa: ANN401 - matplotlib's axes
    stars: Array,
    column: int,
    estimate: tuple[Array, Array],
    used: set[int],
    span: tuple[float, float],
) -> None:
    """Draw the fixes; those beyond the picture lie on its edge, headings are unwrapped to the estimate."""
    known = np.isfinite(stars).all(axis=1)
    exposure_s, shown = stars[known, 0], stars[known, column]
    there = np.isfinite(estimate[0]) & np.isfinite(estimate[1])
    if column == HEADING and there.any():
        near = np.interp(exposure_s, estimate[0][there], estimate[1][there])
        shown = near + np.angle(np.exp(1j * (shown - near)))
    is_used = np.array([round(t * NS) in used for t in exposure_s.tolist()], dtype=np.bool_)
    shown = np.clip(shown, *span)
    place.plot(exposure_s[is_used], shown[is_used], ".", color="0.6", label="fixes used")
    place.plot(exposure_s[~is_used], shown[~is_used], "x", color="tab:red", label="fixes not used")
